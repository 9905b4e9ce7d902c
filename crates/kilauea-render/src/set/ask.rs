//! Whom to ask, and what becomes of several answers.

use kilauea_accel::Ray;
use kilauea_spot::RunError;
use kilauea_texture::TextureStore;
use serde::{Deserialize, Serialize};

use super::Set;
use super::member::Member;
use crate::geometry::Geometry;
use crate::integrator::{Answer, Blame, Question, RayTracer};

/// Who is asked what a ray meets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Broadcast {
    /// Those members whose chunks' boxes the ray pierces.
    #[default]
    Culled,
    /// All members: the rule of Kato & Saito 2002, section 3.
    Full,
}

/// A set as it is asked.
#[derive(Clone, Copy)]
pub(crate) struct Asker<'a> {
    pub(crate) set: &'a Set,
    /// Surfaces of who asks, who may be a member.
    pub(crate) geometry: &'a Geometry,
    /// Images of who asks.
    pub(crate) textures: &'a TextureStore,
    pub(crate) broadcast: Broadcast,
}

/// Members by their number, one bit each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Whom(pub(crate) u64);

impl Whom {
    /// The first `n` members.
    pub(super) fn first(n: usize) -> Self {
        Self(u64::MAX >> (64 - n))
    }

    /// Their numbers, in order.
    pub(crate) fn numbers(self) -> impl Iterator<Item = usize> {
        let mut rest = self.0;
        std::iter::from_fn(move || {
            let number = (rest != 0).then(|| rest.trailing_zeros() as usize)?;
            rest &= rest - 1;
            Some(number)
        })
    }
}

impl Question {
    /// The ray that it is about. Tiles of textures are in files, which all members have: none is asked
    /// for them.
    pub(super) fn ray(&self) -> Option<&Ray> {
        match self {
            Self::Closest { ray, .. } | Self::Occluded { ray, .. } => Some(ray),
            Self::Tile(_) => None,
        }
    }

    /// What decides at surfaces that let some rays pass.
    pub(super) fn key(&self) -> u32 {
        match self {
            Self::Closest { key, .. } | Self::Occluded { key, .. } => *key,
            Self::Tile(_) => 0,
        }
    }

    /// The answer of nobody.
    pub(super) fn answer_of_nobody(&self) -> Answer {
        match self {
            Self::Closest { .. } => Answer::Closest(None),
            Self::Occluded { .. } => Answer::Occluded(false),
            Self::Tile(_) => Answer::Tile(None),
        }
    }
}

impl Answer {
    /// Whether it tells of something on the way of the ray.
    pub(super) fn is_met(&self) -> bool {
        matches!(
            self,
            Self::Met(_) | Self::Closest(Some(_)) | Self::Occluded(true)
        )
    }

    /// What two members' answers to the same question amount to. In whichever order answers are
    /// combined, the outcome is the same: no two hits are equal in distance, instance and primitive.
    pub(super) fn or(self, other: Self) -> Self {
        match (self, other) {
            (Self::Occluded(a), Self::Occluded(b)) => Self::Occluded(a || b),
            (Self::Met(a), Self::Met(b)) if a.hit.wins_over(&b.hit) => Self::Met(a),
            (answer, Self::Closest(None)) => answer,
            (_, other) => other,
        }
    }
}

impl<'a> Asker<'a> {
    /// Who is asked.
    #[inline]
    pub(super) fn whom(&self, question: &Question) -> Whom {
        let Some(ray) = question.ray() else {
            return Whom(0);
        };
        let all = Whom::first(self.set.members.len());
        match self.broadcast {
            Broadcast::Full => all,
            Broadcast::Culled => self.set.boxes.pierced(ray).unwrap_or(all),
        }
    }

    /// Whether some members are in other processes.
    pub(crate) fn is_far(&self) -> bool {
        let is_far = |member: &Member| matches!(member, Member::Elsewhere(_));
        self.set.members.iter().any(is_far)
    }

    /// Members of the set.
    pub(crate) fn n_members(&self) -> usize {
        self.set.members.len()
    }

    /// What answers for a member in this process.
    pub(super) fn tracer_of<const CUTOUTS: bool>(
        &self,
        member: &'a Member,
        blame: &'a Blame,
    ) -> Option<RayTracer<'a, CUTOUTS>> {
        match member {
            Member::Beside(part) => Some(RayTracer::of_part(&part.geometry, &part.textures, blame)),
            Member::Own => Some(RayTracer::of_part(self.geometry, self.textures, blame)),
            Member::Elsewhere(_) => None,
        }
    }

    /// Asks one member after the other, one question each: for those that are few.
    pub(crate) fn answer<const CUTOUTS: bool>(
        &self,
        question: Question,
        blame: &'a Blame,
    ) -> Answer {
        let mut answer = question.answer_of_nobody();
        for number in self.whom(&question).numbers() {
            // A member that can be asked no more fails the frame with the first batch that it is sent,
            // so that what takes its place here comes to nothing.
            let found = self.ask_one::<CUTOUTS>(number, question, blame);
            answer = answer.or(found.unwrap_or_else(|_| question.answer_of_nobody()));
            if answer == Answer::Occluded(true) {
                break;
            }
        }
        answer
    }

    fn ask_one<const CUTOUTS: bool>(
        &self,
        number: usize,
        question: Question,
        blame: &'a Blame,
    ) -> Result<Answer, RunError> {
        match &self.set.members[number] {
            Member::Elsewhere(remote) => {
                let asked = remote.ask(&[question])?;
                let mut answers = asked.answers.into_iter();
                Ok(answers
                    .next()
                    .unwrap_or_else(|| question.answer_of_nobody()))
            }
            member => {
                let tracer = self.tracer_of::<CUTOUTS>(member, blame);
                let answer = tracer.map(|tracer| tracer.answer_of_part(question));
                Ok(answer.unwrap_or_else(|| question.answer_of_nobody()))
            }
        }
    }
}
