//! Results, and what a journal must know of a frame.

use kilauea_render::{CollectedFrame, TileResult};
use kilauea_scene::{RenderSettings, Shading};

use crate::ledger::{Digest, Ledger};
use crate::protocol::{Frame, Message, Start, UnitDone};

/// All of a result in short.
pub(super) fn digest(result: &TileResult) -> Digest {
    let (unit, tally) = (result.unit.clone(), result.tally.clone());
    let said = UnitDone {
        lease: 0,
        unit,
        tally,
    }
    .frame(0, &result.sums);
    *blake3::hash(&said.body).as_bytes()
}

/// Of all settings that the image depends on, and of the camera: not how many threads there are, nor
/// how questions are answered.
pub(super) fn settings_hash(settings: &RenderSettings, camera: &[u8]) -> Digest {
    let settings = RenderSettings {
        threads: 0,
        texture_memory_bytes: 0,
        shading: Shading::Inline,
        shade_memory_bytes: 0,
        ..settings.clone()
    };
    let start = Start {
        settings,
        specialize_rays: true,
        n_scene_bytes: 0,
        scene_hash: [0; 32],
        seat: None,
    };
    *blake3::hash(&start.frame(0, camera).body).as_bytes()
}

/// Puts a result of an earlier run into the frame; whether it follows on what is there.
pub(crate) fn restore(frame: &mut CollectedFrame, ledger: &mut Ledger, kept: &Frame) -> bool {
    let Ok((UnitDone { unit, tally, .. }, sums)) = UnitDone::read(kept) else {
        return false;
    };
    let result = TileResult {
        unit,
        sums: sums.to_vec(),
        tally,
    };
    let (unit, digest) = (result.unit.clone(), digest(&result));
    frame.put(result).is_ok() && ledger.restore(&unit, digest)
}
