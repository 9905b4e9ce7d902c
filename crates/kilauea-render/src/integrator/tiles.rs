//! Tiles of textures that a path asks for before it looks them up.
//!
//! What is looked up does not depend on it: a tile that is not there when it is needed is read within
//! the call. So a path may ask in vain, and where nothing waits it does not ask at all.

use kilauea_accel::Hit;
use kilauea_spot::{Context, Program};
use kilauea_texture::TileId;

use super::fault::Watch;
use super::guide::Guide;
use super::media::Media;
use super::merge::Merge;
use super::path::PathIntegrator;
use super::question::{Answer, Question};
use super::walk::Path;
use crate::geometry::Carried;

/// How often a path asks at a hit: once more than most textures, whose coordinates come from others.
const MAX_ROUNDS: u32 = 2;

impl<const CUTOUTS: bool, M: Media, G: Guide, X: Merge, W: Watch>
    PathIntegrator<'_, CUTOUTS, M, G, X, W>
{
    /// Tiles that the surface at a hit looks up and that are not in memory.
    pub(super) fn absent_tiles(
        &self,
        path: &Path<M, X::Eye>,
        (hit, carried): (&Hit, Option<&Carried>),
    ) -> Vec<TileId> {
        let mut cone = path.cone;
        cone.advance(hit.t);
        let interaction = self.interaction((hit, carried), &path.ray, cone.width);
        let lookups = interaction.shader.lookups();
        lookups.absent_tiles(&interaction.surface)
    }

    /// Asks for the tiles, and for those whose place is known only when these are there.
    pub(super) async fn bring_tiles<P, C>(
        &self,
        mut absent: Vec<TileId>,
        path: &Path<M, X::Eye>,
        met: (&Hit, Option<&Carried>),
        cx: &C,
    ) where
        P: Program<Question = Question, Answer = Answer>,
        C: Context<P>,
    {
        for _ in 0..MAX_ROUNDS {
            let asked = absent
                .drain(..)
                .map(|tile| (tile, cx.ask(Question::Tile(tile))));
            for (tile, answer) in asked.collect::<Vec<_>>() {
                if let Some(texels) = answer.await.texels() {
                    self.textures.take_in(tile, texels);
                }
            }
            absent = self.absent_tiles(path, met);
            if absent.is_empty() {
                break;
            }
        }
    }
}
