use kilauea_math::{DMat4, DVec3, Spectrum};
use kilauea_scene::{Light, LightShape};

/// A light of radiance one in all channels.
pub fn light(shape: LightShape, world_from_light: DMat4) -> Light {
    Light {
        path: "/Light".into(),
        shape,
        world_from_light,
        radiance: Spectrum::ONE,
        texture: None,
        diffuse: 1.0,
        specular: 1.0,
        shaping: None,
        visible_to_camera: true,
    }
}

/// A light of radiance one half that covers a wall of [`Mesh::cube`](crate::Mesh::cube), from just in
/// front of it.
pub fn wall_light(outward: DVec3) -> Light {
    let side = outward.cross(outward.any_orthonormal_vector());
    let columns = [side, outward.cross(side), outward];
    let [x, y, z] = columns.map(|axis| axis.extend(0.0));
    let w = (0.9999 * outward).extend(1.0);
    let shape = LightShape::Rect {
        width: 2.0,
        height: 2.0,
    };
    Light {
        radiance: Spectrum::splat(0.5),
        ..light(shape, DMat4::from_cols(x, y, z, w))
    }
}

/// Places a light at a point, shining toward −y.
pub fn facing_down(x: f64, y: f64, z: f64) -> DMat4 {
    let quarter_turn = std::f64::consts::FRAC_PI_2;
    DMat4::from_translation(DVec3::new(x, y, z)) * DMat4::from_rotation_x(-quarter_turn)
}

/// A rect light of radiance one that shines down from (0, `height`, 0).
pub fn rect_light(width: f64, length: f64, height: f64) -> Light {
    let shape = LightShape::Rect {
        width,
        height: length,
    };
    light(shape, facing_down(0.0, height, 0.0))
}
