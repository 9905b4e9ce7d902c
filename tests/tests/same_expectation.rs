//! Frames that differ in noise alone: what is the same by another way is compared tile by tile.

use kilauea_math::{DAffine3, DMat4, DVec3, Spectrum};
use kilauea_mesh::PrimvarInterpolation;
use kilauea_scene::{FilterKind, Light, LightShape, RenderSettings};
use kilauea_testing::{Chi2, Family, Moments, TileFile, welch_p};
use kilauea_tests::{
    Mesh, MeshPrimvar, Picture, Placements, Stage, black_emitter, facing_down, light, matte,
    matte_from_primvar, orthographic, perspective, preview, rect_light, with_opacity,
};

/// Pictures of each kind.
const N_SEEDS: u32 = 12;
const SIDE: usize = 16;
/// Pixels on the side of a tile: a tile's mean is nearly normal, a pixel's is not.
const TILE: usize = 4;
const N_TILES: usize = (SIDE / TILE) * (SIDE / TILE);
/// Differences below this share are those of rounding.
const RESOLUTION: f64 = 3e-5;

/// Mean and variance over seeds of each tile.
fn tiles(stage: &Stage, first_seed: u32, change: impl Fn(&mut RenderSettings)) -> Vec<Moments> {
    let mut settings = RenderSettings {
        samples_per_pixel: 16,
        max_depth: 4,
        aovs: vec!["Z".into()],
        ..Stage::settings()
    };
    change(&mut settings);
    let prepared = stage.prepare(&settings);
    let mut values = vec![Vec::new(); N_TILES];
    for seed in first_seed..first_seed + N_SEEDS {
        let settings = RenderSettings {
            seed,
            ..settings.clone()
        };
        let picture = Picture::render(&prepared, settings);
        for (tile, mean) in values.iter_mut().zip(tile_means(&picture)) {
            tile.push(mean);
        }
    }
    values.iter().map(|values| Moments::of(values)).collect()
}

fn tile_means(picture: &Picture) -> Vec<f64> {
    let mut means = vec![0.0; N_TILES];
    // Uneven weights, so that channels cannot stand in for each other.
    for (channel, weight) in [("R", 0.5), ("G", 0.3), ("B", 0.2)] {
        for (idx, &value) in picture.channel(channel).iter().enumerate() {
            let tile = idx / SIDE / TILE * (SIDE / TILE) + idx % SIDE / TILE;
            means[tile] += weight * f64::from(value) / (TILE * TILE) as f64;
        }
    }
    means
}

/// p-values of the tiles of two kinds of pictures.
fn compare(a: &[Moments], b: &[Moments]) -> Vec<f64> {
    let p_value = |(a, b): (&Moments, &Moments)| welch_p(a, b, RESOLUTION * a.mean.abs());
    a.iter().zip(b).map(p_value).collect()
}

/// A floor with two blocks under a rect light, the blocks as given.
fn blocks(add: impl FnOnce(&mut Stage, [DAffine3; 2])) -> Stage {
    let mut stage = Stage::new(perspective([0.0, 1.6, 3.0], [0.0, 0.3, 0.0], 0.4));
    stage.materials = vec![
        matte([0.7, 0.6, 0.5]),
        preview(&[("diffuseColor", &[0.2, 0.4, 0.8]), ("roughness", &[0.3])]),
    ];
    stage.meshes.push(Mesh::floor(3.0));
    stage.lights.push(rect_light(1.0, 1.0, 2.0));
    let place = |x, turn| {
        DAffine3::from_translation(DVec3::new(x, 0.3, 0.0))
            * DAffine3::from_rotation_y(turn)
            * DAffine3::from_scale(DVec3::splat(0.3))
    };
    add(&mut stage, [place(-0.5, 0.3), place(0.6, 1.0)]);
    stage
}

fn baked() -> Stage {
    blocks(|stage, places| {
        let cubes = places.map(|place| Mesh::cube().with_material(1).placed(place));
        stage.meshes.extend(cubes);
    })
}

fn instanced(later: Vec<Vec<DAffine3>>, places: [DAffine3; 2], stage: &mut Stage) {
    stage.prototypes.push("/Prototype".into());
    let cube = Mesh::cube().with_material(1).in_prototype(1);
    stage.meshes.push(cube);
    stage.instances.push(Placements {
        parent: 0,
        prototype: 1,
        parent_from_prototype: places.to_vec(),
        primvar: None,
        later,
    });
}

/// The same stage with a change.
fn changed(mut stage: Stage, change: impl FnOnce(&mut Stage)) -> Stage {
    change(&mut stage);
    stage
}

#[test]
fn one_scene_said_in_two_ways() {
    let white = TileFile::new([8, 4], |_, _| [1.0; 3]);
    let quad = [
        [-0.5, 2.0, 0.5],
        [-0.5, 2.0, -0.5],
        [0.5, 2.0, -0.5],
        [0.5, 2.0, 0.5],
    ];
    let half = |x: f64| {
        let shape = LightShape::Rect {
            width: 0.5,
            height: 1.0,
        };
        light(shape, facing_down(x, 2.0, 0.0))
    };
    let dome = light(LightShape::Dome, DMat4::IDENTITY);
    let under_dome = |dome: &Light| changed(baked(), |s| s.lights = vec![dome.clone()]);
    let pictured = Light {
        texture: Some(0),
        ..dome.clone()
    };
    let of_baked = tiles(&baked(), 0, |_| ());

    let mut family = Family::new("ways to say a scene");
    let mut check = |what: &str, stage: &Stage| {
        let found = compare(&of_baked, &tiles(stage, 100, |_| ()));
        for (tile, p) in found.into_iter().enumerate() {
            family.add(format!("{what}, tile {tile}"), p);
        }
    };
    check("the same", &baked());
    let still = blocks(|stage, places| instanced(Vec::new(), places, stage));
    check("instances", &still);
    let moving = blocks(|stage, places| instanced(vec![places.to_vec()], places, stage));
    check("instances that move nowhere", &moving);
    check(
        "a mesh light",
        &changed(baked(), |s| {
            s.lights.clear();
            s.materials.push(black_emitter(1.0));
            s.meshes.push(Mesh::polygon(&quad).with_material(2));
        }),
    );
    check(
        "two halves of the light",
        &changed(baked(), |s| s.lights = vec![half(-0.25), half(0.25)]),
    );
    check(
        "something that is not there",
        &changed(baked(), |s| {
            s.materials.push(with_opacity(matte([0.0; 3]), 0.0));
            let roof = DAffine3::from_translation(DVec3::Y);
            s.meshes
                .push(Mesh::floor(3.0).placed(roof).with_material(2));
        }),
    );
    check(
        "a second light that is black",
        &changed(baked(), |s| {
            let mut dark = rect_light(0.3, 0.3, 1.5);
            dark.radiance = Spectrum::splat(1e-6);
            s.lights.push(dark);
        }),
    );
    let plain = tiles(&under_dome(&dome), 0, |_| ());
    let mut with_picture = under_dome(&pictured);
    with_picture.textures.push(white.source());
    let of_picture = compare(&plain, &tiles(&with_picture, 100, |_| ()));
    for (tile, p) in of_picture.into_iter().enumerate() {
        family.add(format!("a dome with a white picture, tile {tile}"), p);
    }
    family.check();
}

#[test]
fn samplers_for_few_and_for_many_samples() {
    let mut family = Family::new("samples");
    let stage = baked();
    let of_16 = tiles(&stage, 0, |_| ());
    for samples_per_pixel in [1, 3, 64] {
        let other = tiles(&stage, 100, |s| s.samples_per_pixel = samples_per_pixel);
        for (tile, p) in compare(&of_16, &other).into_iter().enumerate() {
            family.add(format!("{samples_per_pixel} samples, tile {tile}"), p);
        }
    }
    family.check();
}

/// Where radiance is a linear function of the place in the picture, no symmetric filter changes it.
#[test]
fn filters_of_a_linear_picture() {
    let mut stage = Stage::new(orthographic([0.0, 1.0, 0.0], [0.0; 3], 1.0));
    // Wider than the picture and the widest filter.
    let mut floor = Mesh::floor(2.0);
    floor.primvars.push(MeshPrimvar {
        name: "albedo".into(),
        interpolation: PrimvarInterpolation::Vertex,
        values: floor
            .points
            .iter()
            .flat_map(|[x, _, z]| [0.5 + 0.2 * x, 0.5 + 0.1 * z, 0.5 + 0.1 * (x + z)])
            .collect(),
    });
    stage.meshes.push(floor);
    stage.materials.push(matte_from_primvar("albedo"));
    stage.lights.push(light(LightShape::Dome, DMat4::IDENTITY));

    let mut family = Family::new("filters");
    let of_box = tiles(&stage, 0, |_| ());
    for (filter, radius) in [
        (FilterKind::Box, 2.0),
        (FilterKind::Gaussian, 1.5),
        (FilterKind::BlackmanHarris, 1.5),
        (FilterKind::BlackmanHarris, 3.0),
    ] {
        let other = tiles(&stage, 100, |s| {
            (s.filter, s.filter_radius) = (filter, Some(radius));
        });
        for (tile, p) in compare(&of_box, &other).into_iter().enumerate() {
            family.add(format!("{filter:?} of {radius}, tile {tile}"), p);
        }
    }
    family.check();
}

#[test]
fn noise_alone_has_even_p_values_and_more_light_has_not() {
    let stage = baked();
    let of = |first_seed| tiles(&stage, first_seed, |_| ());
    let sets: Vec<Vec<Moments>> = (0..6).map(|i| of(1000 * i)).collect();
    let p_values = sets.chunks(2).flat_map(|pair| compare(&pair[0], &pair[1]));
    let mut fifths = [(0.0, (3 * N_TILES) as f64 / 5.0); 5];
    for p in p_values {
        fifths[((5.0 * p) as usize).min(4)].0 += 1.0;
    }
    let evenness = Chi2::test(&fifths).p_value();
    assert!(evenness > 1e-3, "{fifths:?}");

    let brighter = changed(baked(), |s| s.lights[0].radiance *= 1.03);
    let found = compare(&sets[0], &tiles(&brighter, 100, |_| ()));
    let mut family = Family::new("three percent of light");
    for p in found {
        family.add("a tile", p);
    }
    let n_found = family.rejected().count();
    assert!(n_found > N_TILES / 4, "{n_found} of {N_TILES} tiles");
}
