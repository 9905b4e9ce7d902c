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
