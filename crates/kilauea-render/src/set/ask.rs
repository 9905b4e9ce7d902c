//! Whom to ask, and what becomes of several answers.

use kilauea_accel::{Hit, Ray};
use kilauea_spot::RunError;
use kilauea_texture::TextureStore;
use serde::{Deserialize, Serialize};

use super::Set;
use super::member::Member;
use super::photons::{Found, PhotonParts};
use crate::geometry::Geometry;
use crate::integrator::{Answer, Blame, PhotonQuestion, Question, RayTracer};

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
    /// The photons of the frame that are divided.
    pub(crate) photons: &'a PhotonParts,
}

/// Members by their number, one bit each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Whom(pub(crate) u64);

impl Whom {
    const NOBODY: Self = Self(0);

    /// The first `n` members.
    pub(super) fn first(n: usize) -> Self {
        Self(u64::MAX >> (64 - n))
    }

    pub(super) fn is_nobody(self) -> bool {
        self == Self::NOBODY
    }

    pub(super) fn without(self, number: Option<usize>) -> Self {
        Self(self.0 & !number.map_or(0, |number| 1 << number))
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
            Self::Tile(_) | Self::Photons(_) => None,
        }
    }

    /// The look-up of photons that it is.
    pub(super) fn lookup(&self) -> Option<PhotonQuestion> {
        match self {
            Self::Photons(lookup) => Some(*lookup),
            Self::Closest { .. } | Self::Occluded { .. } | Self::Tile(_) => None,
        }
    }

    /// What decides at surfaces that let some rays pass.
    pub(super) fn key(&self) -> u32 {
        match self {
            Self::Closest { key, .. } | Self::Occluded { key, .. } => *key,
            Self::Tile(_) | Self::Photons(_) => 0,
        }
    }

    /// What is left to ask once something is known: nothing where the way of a shadow ray is blocked,
    /// and of other rays no more than the way to what they hit. What is as far as that may still win,
    /// and rays reach it, as their ends are inclusive.
    fn beyond(self, known: &Answer) -> Option<Self> {
        match (self, known) {
            (Self::Occluded { .. }, Answer::Occluded(true)) => None,
            (Self::Closest { ray, key }, known) => {
                let t_max = known.first_hit().map_or(ray.t_max, |hit| hit.t);
                let ray = Ray { t_max, ..ray };
                Some(Self::Closest { ray, key })
            }
            (question, _) => Some(question),
        }
    }

    /// The answer of nobody.
    pub(super) fn answer_of_nobody(&self) -> Answer {
        match self {
            Self::Closest { .. } => Answer::Closest(None),
            Self::Occluded { .. } => Answer::Occluded(false),
            Self::Tile(_) => Answer::Tile(None),
            Self::Photons(_) => Answer::Photons(Some(Vec::new())),
        }
    }
}

impl Answer {
    /// Whether it tells of something on the way of the ray, or of photons.
    pub(super) fn is_met(&self) -> bool {
        if let Self::Photons(photons) = self {
            return photons.as_ref().is_some_and(|photons| !photons.is_empty());
        }
        matches!(
            self,
            Self::Met(_) | Self::Closest(Some(_)) | Self::Occluded(true)
        )
    }

    /// What was hit first.
    fn first_hit(&self) -> Option<&Hit> {
        match self {
            Self::Closest(hit) => hit.as_ref(),
            Self::Met(met) => Some(&met.hit),
            Self::Occluded(_) | Self::Tile(_) | Self::Photons(_) => None,
        }
    }

    /// What two members' answers to the same question amount to. In whichever order answers are
    /// combined, the outcome is the same: no two hits are equal in distance, instance and primitive, and
    /// photons are added up in any order.
    pub(super) fn or(mut self, mut other: Self) -> Self {
        if let (Self::Photons(some), Self::Photons(others)) = (&mut self, &mut other) {
            let all = some.take().zip(others.take());
            return Self::Photons(all.map(|(mut some, others)| {
                some.extend(others);
                some
            }));
        }
        let is_first = match (&self, &other) {
            (Self::Occluded(is_occluded), _) => *is_occluded,
            _ => match (self.first_hit(), other.first_hit()) {
                (Some(a), Some(b)) => a.wins_over(b),
                (a, _) => a.is_some(),
            },
        };
        if is_first { self } else { other }
    }
}

/// A question of which who asks has seen what it knows by itself.
pub(super) struct Begun {
    /// Its own part of the answer, if it is a member.
    pub(super) known: Option<Answer>,
    /// What is left to ask.
    pub(super) question: Question,
    /// Of whom; of nobody where the answer is known.
    pub(super) whom: Whom,
}

impl<'a> Asker<'a> {
    /// Who is asked beside the one who asks.
    #[inline]
    fn whom(&self, question: &Question) -> Whom {
        let own = self.set.own;
        let all = Whom::first(self.set.members.len()).without(own);
        match (question.ray(), self.broadcast) {
            (Some(ray), Broadcast::Culled) => self.set.boxes.pierced(ray, own).unwrap_or(all),
            (Some(_), Broadcast::Full) => all,
            (None, _) if matches!(question, Question::Photons(_)) => all,
            (None, _) => Whom::NOBODY,
        }
    }

    /// Answers as far as who asks is a member, and says who else is to be asked what.
    #[inline]
    pub(super) fn begin<const CUTOUTS: bool>(&self, question: Question, blame: &'a Blame) -> Begun {
        let known = self.set.own.map(|own| match &question {
            Question::Photons(question) => self.photons_of(own, question),
            _ => RayTracer::<CUTOUTS>::of_part(self.geometry, self.textures, blame)
                .answer_here(question),
        });
        let left = match (&known, self.broadcast) {
            (Some(known), Broadcast::Culled) => question.beyond(known),
            _ => Some(question),
        };
        let whom = left.map_or(Whom::NOBODY, |left| self.whom(&left));
        Begun {
            known,
            question: left.unwrap_or(question),
            whom,
        }
    }

    /// The photons that a member in this process has: they are here before anyone asks.
    pub(super) fn photons_of(&self, member: usize, question: &PhotonQuestion) -> Answer {
        match self.photons.look_up(member, question) {
            Found::Photons(answer) => answer,
            Found::Later | Found::Closed => Answer::Photons(None),
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

    /// Asks one member after the other, one question each: for those that are few.
    pub(crate) fn answer<const CUTOUTS: bool>(
        &self,
        question: Question,
        blame: &'a Blame,
    ) -> Answer {
        let Begun {
            known,
            question,
            whom,
        } = self.begin::<CUTOUTS>(question, blame);
        let mut answer = known.unwrap_or_else(|| question.answer_of_nobody());
        for number in whom.numbers() {
            let Some(left) = question.beyond(&answer) else {
                break;
            };
            // A member that can be asked no more fails the frame with the first batch that it is sent,
            // so that what takes its place here comes to nothing.
            let found = self.ask_one::<CUTOUTS>(number, left, blame);
            answer = answer.or(found.unwrap_or_else(|_| question.answer_of_nobody()));
        }
        answer
    }

    fn ask_one<const CUTOUTS: bool>(
        &self,
        number: usize,
        question: Question,
        blame: &'a Blame,
    ) -> Result<Answer, RunError> {
        match (&self.set.members[number], &question) {
            (Member::Elsewhere(remote), _) => {
                let asked = remote.ask(vec![question])?;
                let mut answers = asked.answers.into_iter();
                Ok(answers
                    .next()
                    .unwrap_or_else(|| question.answer_of_nobody()))
            }
            (_, Question::Photons(question)) => Ok(self.photons_of(number, question)),
            (member, _) => {
                let tracer = member.tracer::<CUTOUTS>(blame);
                let answer = tracer.map(|tracer| tracer.answer_of_part(question));
                Ok(answer.unwrap_or_else(|| question.answer_of_nobody()))
            }
        }
    }
}
