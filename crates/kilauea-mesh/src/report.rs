/// What went wrong with one prim and did not stop the rest.
#[derive(Clone, Debug, Default)]
pub(crate) struct Report {
    pub(crate) warnings: Vec<String>,
    pub(crate) n_rejected_triangles: usize,
}

impl Report {
    /// Notes a finding: prim, attribute, what.
    pub(crate) fn warn(&mut self, path: &str, attribute: &str, what: impl std::fmt::Display) {
        self.warnings.push(format!("{path}: {attribute}: {what}"));
    }

    pub(crate) fn append(&mut self, mut other: Self) {
        self.warnings.append(&mut other.warnings);
        self.n_rejected_triangles += other.n_rejected_triangles;
    }
}
