//! The text exposition format 0.0.4: families of samples, a line each.
//! <https://prometheus.io/docs/instrumenting/exposition_formats/>

use std::fmt::Write;

/// What a server may do with a family.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Only grows, apart from a new start at zero.
    Counter,
    /// Goes up and down.
    Gauge,
}

/// A value, and what tells it from others of its family.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sample {
    pub(super) labels: Vec<(&'static str, String)>,
    pub(super) value: f64,
}

/// Appends a family: nothing where it has no samples.
pub(super) fn write_family(
    page: &mut String,
    (name, kind, help): (&str, Kind, &str),
    samples: &[Sample],
) {
    if samples.is_empty() {
        return;
    }
    let kind = match kind {
        Kind::Counter => "counter",
        Kind::Gauge => "gauge",
    };
    let help = help.replace('\\', r"\\").replace('\n', r"\n");
    // Writing to a string cannot fail.
    let _ = write!(page, "# HELP {name} {help}\n# TYPE {name} {kind}\n");
    for Sample { labels, value } in samples {
        page.push_str(name);
        for (i, (label, text)) in labels.iter().enumerate() {
            let before = if i == 0 { '{' } else { ',' };
            let _ = write!(page, "{before}{label}=\"{}\"", escaped(text));
        }
        if !labels.is_empty() {
            page.push('}');
        }
        let _ = writeln!(page, " {}", number(*value));
    }
}

fn escaped(text: &str) -> String {
    let text = text.replace('\\', r"\\").replace('"', "\\\"");
    text.replace('\n', r"\n")
}

/// As Go writes it: infinities have names of their own.
fn number(value: f64) -> String {
    if value.is_infinite() {
        return if value > 0.0 { "+Inf" } else { "-Inf" }.into();
    }
    value.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn families_as_the_format_has_them() {
        let mut page = String::new();
        let plain = Sample {
            labels: Vec::new(),
            value: 12_000_000_000.0,
        };
        write_family(
            &mut page,
            ("a_total", Kind::Counter, "All\nof \\ it."),
            &[plain],
        );
        let labelled = Sample {
            labels: vec![("worker", "0".into()), ("name", "a \"b\"\\\n".into())],
            value: f64::INFINITY,
        };
        write_family(&mut page, ("b", Kind::Gauge, "B."), &[labelled]);
        write_family(&mut page, ("c", Kind::Gauge, "Not there."), &[]);
        let expected = [
            "# HELP a_total All\\nof \\\\ it.",
            "# TYPE a_total counter",
            "a_total 12000000000",
            "# HELP b B.",
            "# TYPE b gauge",
            "b{worker=\"0\",name=\"a \\\"b\\\"\\\\\\n\"} +Inf",
            "",
        ];
        assert_eq!(page, expected.join("\n"));
        assert_eq!(number(f64::NAN), "NaN");
        assert_eq!(number(0.25), "0.25");
    }
}
