//! Refuses settings that no frame can be rendered with.

use kilauea_scene::RenderSettings;

use crate::RenderError;

pub(crate) fn check_settings(settings: &RenderSettings) -> Result<(), RenderError> {
    let fail = |name, value: String, reason| {
        Err(RenderError::Setting {
            name,
            value,
            reason,
        })
    };
    let [width, height] = settings.resolution;
    if width == 0 || height == 0 || width > 65536 || height > 65536 {
        let value = format!("{width} x {height}");
        return fail("resolution", value, "each side must be 1 to 65536 pixels");
    }
    if settings.samples_per_pixel == 0 {
        return fail("samples_per_pixel", "0".into(), "must be at least 1");
    }
    if let Some(w) = settings.data_window
        && (w.min[0] >= w.max[0] || w.min[1] >= w.max[1])
    {
        return fail(
            "data_window",
            format!("{w:?}"),
            "must hold at least one pixel",
        );
    }
    if let Some(radius) = settings.filter_radius
        && !(radius > 0.0 && radius.is_finite())
    {
        return fail("filter_radius", radius.to_string(), "must be positive");
    }
    if let Some(noise) = settings.noise
        && !(noise > 0.0 && noise.is_finite())
    {
        return fail("noise", noise.to_string(), "must be positive");
    }
    if let Some(secs) = settings.time_limit_secs
        && !secs.is_finite()
    {
        return fail("time_limit_secs", secs.to_string(), "must be a number");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use kilauea_scene::DataWindow;

    #[test]
    fn impossible_settings_are_refused() {
        let with = |change: fn(&mut RenderSettings)| {
            let mut settings = RenderSettings::default();
            change(&mut settings);
            check_settings(&settings)
        };
        assert!(with(|_| ()).is_ok());
        assert!(with(|s| s.resolution = [0, 4]).is_err());
        assert!(with(|s| s.samples_per_pixel = 0).is_err());
        assert!(
            with(|s| s.data_window = Some(DataWindow {
                min: [3, 0],
                max: [3, 4]
            }))
            .is_err()
        );
        assert!(with(|s| s.filter_radius = Some(f32::NAN)).is_err());
        assert!(with(|s| s.noise = Some(0.0)).is_err());
        assert!(with(|s| s.noise = Some(0.01)).is_ok());
    }
}
