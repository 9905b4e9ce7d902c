use kilauea_math::Vec2;
use kilauea_scene::Wrap;

/// No textures.
#[derive(Debug, Default)]
pub struct TextureStore;

impl TextureStore {
    /// Always missing.
    pub fn sample(
        &self,
        _texture: u32,
        _st: Vec2,
        _width: f32,
        _wrap: [Wrap; 2],
    ) -> Option<[f32; 4]> {
        None
    }
}
