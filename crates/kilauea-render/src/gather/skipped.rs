//! Why paths are not told what could be learnt.

use super::GatherEstimate;

impl GatherEstimate {
    /// Of lights and of directions, for each of which paths are told nothing: why, in words with
    /// figures.
    pub fn skipped(&self) -> Vec<String> {
        let of_lights = self.lights.is_none().then(|| self.why_no_lights());
        let of_directions = self.directions.is_none().then(|| self.why_no_directions());
        let reasons = [("lights", of_lights), ("directions", of_directions)];
        let named = |(what, reason): (&str, Option<String>)| Some(format!("{what}: {}", reason?));
        reasons.into_iter().filter_map(named).collect()
    }

    fn why_no_lights(&self) -> String {
        let found = &self.found;
        if found.paths == 0 {
            NO_PILOT.to_owned()
        } else if found.choices == 0 {
            "paths have none to choose from".to_owned()
        } else if found.pixels_tried == 0 {
            promised(found.forecast_of_lights)
        } else {
            tried(found.gain_of_lights)
        }
    }

    fn why_no_directions(&self) -> String {
        let found = &self.found;
        if found.paths == 0 {
            NO_PILOT.to_owned()
        } else if found.efficiency_of_directions == 0.0 {
            promised(found.forecast)
        } else {
            tried(found.efficiency_of_directions)
        }
    }
}

const NO_PILOT: &str = "the frame has no pilot, as it has too few paths";

fn promised(gain: f32) -> String {
    format!("what plain paths found promises a factor of {gain:.2}")
}

fn tried(gain: f32) -> String {
    format!("by a trial paths would be {gain:.2} times as efficient")
}
