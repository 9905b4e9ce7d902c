use kilauea_math::Vec3;

/// One step of a choice: which of two ways was taken at a fork.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// Number of the fork.
    pub fork: u32,
    /// Probability of its first way.
    pub first: f32,
    /// Whether the second was taken.
    pub took_second: bool,
}

/// A light that a path chose where it scattered, and what came of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChoiceRecord {
    /// Where it scattered, engine space.
    pub p: Vec3,
    /// Unit shading normal on the side that is seen.
    pub n: Vec3,
    /// Column and row of its pixel.
    pub pixel: [i32; 2],
    /// Luminance that the pixel got of the light; 0 where something was in between.
    pub brought: f32,
    /// Its first turn.
    first_turn: u32,
    n_turns: u32,
}

/// Records of choices, with the turns of each.
#[derive(Clone, Debug, Default)]
pub struct ChoiceRecords {
    records: Vec<ChoiceRecord>,
    turns: Vec<Turn>,
}

impl ChoiceRecord {
    /// Whether it says anything: no NaN, no infinity, nothing negative.
    pub(crate) fn is_sound(&self) -> bool {
        self.p.is_finite() && self.n.is_finite() && self.brought.is_finite() && self.brought >= 0.0
    }
}

impl ChoiceRecords {
    /// Adds a choice that has brought nothing yet. `place` is a position and a normal, as in
    /// [`ChoiceRecord`].
    pub fn push(&mut self, place: [Vec3; 2], pixel: [i32; 2], turns: &[Turn]) {
        let [p, n] = place;
        let first_turn = self.turns.len() as u32;
        self.turns.extend(turns);
        self.records.push(ChoiceRecord {
            p,
            n,
            pixel,
            brought: 0.0,
            first_turn,
            n_turns: turns.len() as u32,
        });
    }

    /// Says what the last choice brought.
    pub fn set_last_brought(&mut self, brought: f32) {
        if let Some(record) = self.records.last_mut() {
            record.brought = brought;
        }
    }

    /// Adds all records of `others`.
    pub fn append(&mut self, others: &Self) {
        let shift = self.turns.len() as u32;
        self.turns.extend(&others.turns);
        self.records
            .extend(others.records.iter().map(|record| ChoiceRecord {
                first_turn: record.first_turn + shift,
                ..*record
            }));
    }

    /// Number of records.
    pub fn len(&self) -> usize {
        self.records.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// All records, in their order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &ChoiceRecord> {
        self.records.iter()
    }

    /// The turns of one of its records.
    pub fn turns(&self, record: &ChoiceRecord) -> &[Turn] {
        &self.turns[record.first_turn as usize..][..record.n_turns as usize]
    }

    /// Those of its records for which `is_kept`.
    pub(crate) fn filter(&self, is_kept: impl Fn(&ChoiceRecord) -> bool) -> Self {
        let mut kept = Self::default();
        for record in self.records.iter().filter(|record| is_kept(record)) {
            let first_turn = kept.turns.len() as u32;
            kept.turns.extend(self.turns(record));
            kept.records.push(ChoiceRecord {
                first_turn,
                ..*record
            });
        }
        kept
    }
}
