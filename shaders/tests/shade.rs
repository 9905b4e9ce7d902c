//! What shaders ask while they shade, and what becomes of the answers.

#![forbid(unsafe_code)]

#[path = "writing_shaders/tinted_bounce.rs"]
mod tinted_bounce;

use std::cell::Cell;
use std::future::poll_fn;
use std::pin::pin;
use std::task::{Context, Poll, Waker};

use kilauea_bsdf::SeenBsdf;
use kilauea_math::{Spectrum, Vec2, Vec3};
use kilauea_scene::{Channel, Input, Material, MeshChunk, Node};
use kilauea_shading::{
    Element, Scattered, Shade, ShaderInputs, Surface, SurfaceShader, TextureStore,
};
use shaders::Shader;
use tinted_bounce::TintedBounce;

/// A renderer in which half of the light of the lights and all of the path's is there once both
/// were asked for and somebody has answered.
struct Slow<'a> {
    surface: Surface<'a>,
    state: &'a State,
}

#[derive(Default)]
struct State {
    asked_direct: Cell<bool>,
    asked_indirect: Cell<bool>,
    is_answered: Cell<bool>,
}

impl State {
    /// Resolves once the answers are there.
    fn answer(&self, light: Scattered) -> impl Future<Output = Scattered> + Unpin {
        poll_fn(move |_| {
            let all_asked = self.asked_direct.get() && self.asked_indirect.get();
            assert!(all_asked, "waits before all is asked");
            if self.is_answered.get() {
                Poll::Ready(light)
            } else {
                Poll::Pending
            }
        })
    }
}

impl<'a> Shade for Slow<'a> {
    fn surface(&self) -> &Surface<'_> {
        &self.surface
    }

    fn direct_light(
        &mut self,
        bsdf: &SeenBsdf,
    ) -> impl Future<Output = Scattered> + Unpin + use<'a> {
        self.state.asked_direct.set(true);
        self.state.answer(Scattered {
            diffuse: bsdf.albedo() * 0.5,
            ..Scattered::NOTHING
        })
    }

    fn indirect(self, _: &SeenBsdf) -> impl Future<Output = Scattered> + Unpin + use<'a> {
        self.state.asked_indirect.set(true);
        self.state.answer(Scattered::BY_PATH)
    }
}

fn material(shader: &str, inputs: &[(&str, [f32; 3])]) -> Material {
    let nodes = inputs.iter().map(|&(_, [r, g, b])| Node::Constant {
        value: [r, g, b, 1.0],
    });
    let names = inputs.iter().zip(0..).map(|(&(name, _), node)| {
        let channel = Channel::Rgb;
        (name.to_owned(), Input { node, channel })
    });
    Material {
        path: "/Looks/Test".into(),
        shader: shader.into(),
        inputs: names.collect(),
        nodes: nodes.collect(),
    }
}

/// Runs a shade on a triangle that faces the viewer, which waits once.
fn shade(start: impl AsyncFnOnce(Slow<'_>) -> Scattered) -> Scattered {
    let chunk = MeshChunk {
        positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        triangles: vec![[0, 1, 2]],
        ..MeshChunk::default()
    };
    let (textures, _) = TextureStore::open(&[], 0);
    let state = State::default();
    let slow = Slow {
        surface: Surface {
            p: Vec3::ZERO,
            ng: Vec3::Z,
            ns: Vec3::Z,
            wo: Vec3::Z,
            corners: chunk.corners(0),
            barycentrics: Vec2::ZERO,
            attributes: &[],
            element: Element::triangle(&chunk, 0),
            primvars: &[],
            instance_primvars: &[],
            instance_index: 0,
            outside_ior: 1.0,
            footprint: 0.0,
            textures: &textures,
        },
        state: &state,
    };
    let mut shade = pin!(start(slow));
    let mut task = Context::from_waker(Waker::noop());
    assert_eq!(shade.as_mut().poll(&mut task), Poll::Pending);
    state.is_answered.set(true);
    match shade.poll(&mut task) {
        Poll::Ready(light) => light,
        Poll::Pending => panic!("waits for something else"),
    }
}

#[test]
fn shaders_ask_for_all_light_before_they_wait_for_any() {
    for name in Shader::NAMES {
        let shader = Shader::compile(&material(name, &[])).unwrap();
        let light = shade(async |cx| shader.shade(cx).await);
        assert_eq!(light.path, Spectrum::ONE, "{name}");
        assert!(!light.diffuse.is_black(), "{name}");
    }
}

#[test]
fn a_shader_may_weigh_what_it_asked_for() {
    let material = material(
        TintedBounce::NAME,
        &[("albedo", [0.5; 3]), ("bounce", [2.0, 0.5, 0.0])],
    );
    let shader = TintedBounce::compile(&mut ShaderInputs::new(&material)).unwrap();
    let light = shade(async |cx| shader.shade(cx).await);
    assert_eq!(light.diffuse, Spectrum::splat(0.25));
    assert_eq!(light.path, Spectrum::new(2.0, 0.5, 0.0));
}

#[test]
fn light_adds_and_scales() {
    let direct = Scattered {
        diffuse: Spectrum::splat(1.0),
        specular: Spectrum::splat(2.0),
        ..Scattered::NOTHING
    };
    let both = (direct + Scattered::BY_PATH) * 0.5;
    assert_eq!(both.diffuse, Spectrum::splat(0.5));
    assert_eq!(both.specular, Spectrum::splat(1.0));
    assert_eq!(both.path, Spectrum::splat(0.5));
}
