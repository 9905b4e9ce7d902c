//! What training paths and tried pixels tell, as bytes: for those who need it and did not follow them.

use kilauea_gather::{ChoiceRecords, PictureSample, Turn};
use kilauea_spot::{Wire, WireError};

use super::training_pass::Trained;
use super::trial::Tried;
use crate::integrator::RayTally;
use crate::wire::{
    put_list, put_pixel, put_record, put_vec, take_list, take_pixel, take_record, take_vec,
};

impl Wire for Trained {
    fn encode(&self, bytes: &mut Vec<u8>) {
        put_list(&self.records, put_record, bytes);
        put_choices(&self.choices, bytes);
        put_list(&self.samples, put_sample, bytes);
        put_counts(self.counts, bytes);
    }

    fn decode(bytes: &mut &[u8]) -> Result<Self, WireError> {
        Ok(Self {
            records: take_list(take_record, bytes)?,
            choices: take_choices(bytes)?,
            samples: take_list(take_sample, bytes)?,
            counts: take_counts(bytes)?,
        })
    }
}

impl Wire for Tried {
    fn encode(&self, bytes: &mut Vec<u8>) {
        put_list(&self.plain, put_sample, bytes);
        put_list(&self.told, put_sample, bytes);
        put_counts(self.counts, bytes);
    }

    fn decode(bytes: &mut &[u8]) -> Result<Self, WireError> {
        Ok(Self {
            plain: take_list(take_sample, bytes)?,
            told: take_list(take_sample, bytes)?,
            counts: take_counts(bytes)?,
        })
    }
}

fn put_sample(sample: &PictureSample, bytes: &mut Vec<u8>) {
    put_pixel(sample.pixel, bytes);
    [sample.luminance, sample.n_rays].encode(bytes);
}

fn take_sample(bytes: &mut &[u8]) -> Result<PictureSample, WireError> {
    Ok(PictureSample {
        pixel: take_pixel(bytes)?,
        luminance: f32::decode(bytes)?,
        n_rays: f32::decode(bytes)?,
    })
}

fn put_choices(choices: &ChoiceRecords, bytes: &mut Vec<u8>) {
    (choices.len() as u32).encode(bytes);
    for record in choices.iter() {
        put_vec(record.p, bytes);
        put_vec(record.n, bytes);
        put_pixel(record.pixel, bytes);
        record.brought.encode(bytes);
        put_list(choices.turns(record), put_turn, bytes);
    }
}

fn take_choices(bytes: &mut &[u8]) -> Result<ChoiceRecords, WireError> {
    let mut choices = ChoiceRecords::default();
    for _ in 0..u32::decode(bytes)? {
        let place = [take_vec(bytes)?, take_vec(bytes)?];
        let pixel = take_pixel(bytes)?;
        let brought = f32::decode(bytes)?;
        choices.push(place, pixel, &take_list(take_turn, bytes)?);
        choices.set_last_brought(brought);
    }
    Ok(choices)
}

fn put_turn(turn: &Turn, bytes: &mut Vec<u8>) {
    turn.fork.encode(bytes);
    turn.first.encode(bytes);
    turn.took_second.encode(bytes);
}

fn take_turn(bytes: &mut &[u8]) -> Result<Turn, WireError> {
    Ok(Turn {
        fork: u32::decode(bytes)?,
        first: f32::decode(bytes)?,
        took_second: bool::decode(bytes)?,
    })
}

fn put_counts(counts: RayTally, bytes: &mut Vec<u8>) {
    let RayTally {
        camera,
        shadow,
        indirect,
        invalid,
        in_too_many_media,
    } = counts;
    for count in [camera, shadow, indirect, invalid, in_too_many_media] {
        count.encode(bytes);
    }
}

fn take_counts(bytes: &mut &[u8]) -> Result<RayTally, WireError> {
    Ok(RayTally {
        camera: u32::decode(bytes)?,
        shadow: u32::decode(bytes)?,
        indirect: u32::decode(bytes)?,
        invalid: u32::decode(bytes)?,
        in_too_many_media: u32::decode(bytes)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::RayCounts;
    use kilauea_gather::{Arrival, GatherRecord};
    use kilauea_math::Vec3;

    const COUNTS: RayTally = RayTally {
        camera: 1,
        shadow: 2,
        indirect: 3,
        invalid: 4,
        in_too_many_media: 5,
    };

    fn sample(luminance: f32) -> PictureSample {
        PictureSample {
            pixel: [-3, 4],
            luminance,
            n_rays: 5.5,
        }
    }

    fn trained() -> Trained {
        let turn = |fork, took_second| Turn {
            fork,
            first: 0.25,
            took_second,
        };
        let mut choices = ChoiceRecords::default();
        choices.push([Vec3::X, Vec3::Y], [1, 2], &[turn(0, true), turn(9, false)]);
        choices.set_last_brought(0.5);
        choices.push([Vec3::Z, Vec3::NEG_Y], [-1, 7], &[turn(3, true)]);
        Trained {
            records: vec![GatherRecord {
                p: Vec3::new(1.0, -0.0, 3.0),
                n: Vec3::Y,
                arrival: Arrival {
                    wi: Vec3::Z,
                    irradiance: 5.0,
                    pdf: 0.5,
                },
                pixel: [-1, 2],
                brought: 6.0,
            }],
            choices,
            samples: vec![sample(0.0), sample(2.0)],
            counts: COUNTS,
        }
    }

    /// Reads what was written, and refuses all that is cut.
    fn read<L: Wire>(left: &L) -> L {
        let mut bytes = Vec::new();
        left.encode(&mut bytes);
        let mut rest = &bytes[..];
        let read = L::decode(&mut rest).expect("it is whole");
        assert!(rest.is_empty());
        for end in 0..bytes.len() {
            let cut = L::decode(&mut &bytes[..end]);
            assert_eq!(cut.err(), Some(WireError::Short), "{end}");
        }
        read
    }

    #[test]
    fn what_training_paths_found_survives_and_what_is_cut_is_refused() {
        let (left, read) = (trained(), read(&trained()));
        assert_eq!(read.records, left.records);
        assert_eq!(read.samples, left.samples);
        let choices = |of: &Trained| format!("{:?}", of.choices);
        assert_eq!(choices(&read), choices(&left));
        assert_eq!(RayCounts::from(read.counts), COUNTS.into());
    }

    #[test]
    fn what_trials_told_survives_and_what_is_cut_is_refused() {
        let tried = Tried {
            plain: vec![sample(1.0)],
            told: vec![sample(2.0), sample(3.0)],
            counts: COUNTS,
        };
        let read = read(&tried);
        assert_eq!((read.plain, read.told), (tried.plain, tried.told));
        assert_eq!(RayCounts::from(read.counts), COUNTS.into());
    }
}
