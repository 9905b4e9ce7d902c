//! Choices of lights: what cells know of them, and what that is worth, is told by paths that knew
//! nothing.

#![forbid(unsafe_code)]

use kilauea_gather::{
    ChoiceField, ChoiceRecords, PLAIN_CHOICES, PathError, PictureEstimate, PictureSample, Turn,
    forecast_choice,
};
use kilauea_math::Vec3;
use kilauea_testing::uniforms;

const SIDE: i32 = 64;
/// By two forks, one after the other: the second one's number follows from the first way.
const N_LIGHTS: usize = 4;

/// A strip of floor with four lights above, of which each place sees some.
struct Strip {
    /// What a light brings to a place, from 0 to 1 along the strip, if it were the only one.
    light_at: fn(usize, f32) -> f32,
}

/// Each quarter of the strip sees one light.
const WALLS: Strip = Strip {
    light_at: |light, x| f32::from(u8::from((x * N_LIGHTS as f32) as usize == light)),
};
const NO_WALLS: Strip = Strip {
    light_at: |_, _| 0.25,
};

/// What was chosen, and found.
struct Found {
    choices: ChoiceRecords,
    picture: PictureEstimate,
    plain: PathError,
    n_paths: usize,
}

/// Ways to a light, by importance.
fn turns(light: usize) -> [Turn; 2] {
    let [side, end] = [light / 2, light % 2];
    [(0, side), (1 + side as u32, end)].map(|(fork, way)| Turn {
        fork,
        first: 0.5,
        took_second: way == 1,
    })
}

impl Strip {
    fn place(x: f32) -> [Vec3; 2] {
        [Vec3::new(x, 0.0, 0.0), Vec3::Y]
    }

    /// What `n` paths find that choose lights evenly; what each brings is scaled by `noise`.
    fn look(&self, stream: u32, n: u32, noise: impl Fn(u32) -> f32) -> Found {
        let mut choices = ChoiceRecords::default();
        let mut samples = Vec::new();
        for i in 0..n {
            let [x, u] = uniforms(stream, i);
            let light = (u * N_LIGHTS as f32) as usize;
            let pixel = [(i / 2) as i32 % SIDE, (i / 2) as i32 / SIDE % SIDE];
            choices.push(Self::place(x), pixel, &turns(light));
            let brought = (self.light_at)(light, x) * N_LIGHTS as f32 * noise(i);
            choices.set_last_brought(brought);
            samples.push(PictureSample {
                pixel,
                luminance: brought,
                n_rays: 1.0,
            });
        }
        let picture = PictureEstimate::fit([0; 2], [SIDE; 2], &samples).expect("there is light");
        let plain = picture.error_of(&samples).expect("there are samples");
        Found {
            choices,
            picture,
            plain,
            n_paths: n as usize,
        }
    }

    /// Variance of paths that choose lights by a field, without what differs between places.
    fn variance(&self, field: &ChoiceField) -> f32 {
        let n_places = 1000;
        let of_place = |i| {
            let x = (i as f32 + 0.5) / n_places as f32;
            let [p, normal] = Self::place(x);
            let cell = field.at(p, normal);
            let lights = (0..N_LIGHTS).map(|light| {
                let by_cell: f32 = turns(light)
                    .iter()
                    .map(|turn| {
                        let first = cell.first(turn.fork, turn.first);
                        if turn.took_second { 1.0 - first } else { first }
                    })
                    .product();
                let pdf = PLAIN_CHOICES / N_LIGHTS as f32 + (1.0 - PLAIN_CHOICES) * by_cell;
                let light = (self.light_at)(light, x);
                (light, light * light / pdf)
            });
            let (mean, second) = lights.fold((0.0, 0.0), |(m, s), (light, sq)| (m + light, s + sq));
            second - mean * mean
        };
        (0..n_places).map(of_place).sum::<f32>() / n_places as f32
    }
}

impl Found {
    fn gain(&self) -> f32 {
        self.forecast().expect("there are records").gain
    }

    fn forecast(&self) -> Option<kilauea_gather::ChoiceForecast> {
        let Self {
            choices,
            picture,
            plain,
            n_paths,
        } = self;
        forecast_choice(choices, picture, *plain, *n_paths)
    }
}

#[test]
fn what_is_promised_is_what_choices_gain() {
    let found = WALLS.look(3, 16_000, |_| 1.0);
    let field = ChoiceField::fit(&WALLS.look(4, 8_000, |_| 1.0).choices, &found.picture)
        .expect("there are records");
    // One of four lights brings four times the mean: plain paths have a variance of three.
    let gained = 3.0 / WALLS.variance(&field);
    assert!(gained > 4.0, "{gained}");
    let ratio = found.gain() / gained;
    assert!((ratio - 1.0).abs() < 0.15, "{ratio}, {gained}");
}

#[test]
fn a_few_records_do_no_harm() {
    for (n, most) in [(40, 3.2), (200, 3.0), (1000, 2.0)] {
        let found = NO_WALLS.look(5, n, |_| 1.0);
        let field = ChoiceField::fit(&found.choices, &found.picture).expect("there are records");
        // Nothing that the lights bring differs: all variance is by the choices of the field.
        let variance = NO_WALLS.variance(&field);
        assert!(variance < 1e-6, "{n}: {variance}");
        let few = WALLS.look(6, n, |_| 1.0);
        let field = ChoiceField::fit(&few.choices, &few.picture).expect("there are records");
        let variance = WALLS.variance(&field);
        assert!(variance < most, "{n}: {variance}");
    }
}

#[test]
fn noise_is_not_taken_for_knowledge() {
    // What one in eight brings is nobody's merit.
    let rare = |i: u32| {
        if uniforms::<1>(9, i)[0] < 0.125 {
            8.0
        } else {
            0.0
        }
    };
    let gain = NO_WALLS.look(7, 4_000, rare).gain();
    assert!(gain < 1.01, "{gain}");
}

#[test]
fn choices_that_bring_nothing_are_counted() {
    let found = WALLS.look(8, 4_000, |_| 1.0);
    let in_vain = found.forecast().expect("there are records").in_vain;
    assert!((in_vain - 0.75).abs() < 0.03, "{in_vain}");
    let found = NO_WALLS.look(8, 4_000, |_| 1.0);
    assert_eq!(found.forecast().map(|f| f.in_vain), Some(0.0));
}

#[test]
fn records_that_are_no_numbers_say_nothing() {
    let mut found = WALLS.look(10, 2_000, |_| 1.0);
    let field = ChoiceField::fit(&found.choices, &found.picture);
    for brought in [f32::NAN, f32::INFINITY, -1.0] {
        let [p, n] = Strip::place(0.5);
        found.choices.push([p, n], [0; 2], &turns(0));
        found.choices.set_last_brought(brought);
        found.choices.push([f32::NAN * p, n], [0; 2], &turns(0));
    }
    assert_eq!(ChoiceField::fit(&found.choices, &found.picture), field);
    assert!(found.gain() > 1.5);
    let nothing = ChoiceRecords::default();
    assert!(ChoiceField::fit(&nothing, &found.picture).is_none());
    assert!(forecast_choice(&nothing, &found.picture, found.plain, 2_000).is_none());
}
