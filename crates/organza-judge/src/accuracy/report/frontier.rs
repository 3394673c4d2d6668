//! The part of the page that recommends settings: the frontier as a table, each row with lines for a scene file.

use crate::accuracy::plot::escaped;
use crate::accuracy::resolve::MARGIN;
use crate::accuracy::{Distance, Outcome, Study, least_seconds, lines};
use organza::scene::Scene;
use std::fmt::Write;

/// What lies on a frontier, beside a plot that shows one.
pub(super) const RULE: &str = "The pale line is the frontier: from the most accurate setting on, what is faster than the last one on it \
                               by more than 10 %. Errors that are equal to two digits, or within the noise of random settings, count as one.";

/// The picture that errors of settings are counted from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Against {
    Limit,
    Truth,
}

impl Against {
    fn distance(self, outcome: &Outcome) -> Option<&Distance> {
        match self {
            Self::Limit => outcome.from_limit.as_ref(),
            Self::Truth => outcome.from_truth.as_ref(),
        }
    }
}

/// Rows of settings, from the most accurate to the fastest.
pub(super) fn to_copy<'a>(
    html: &mut String,
    scene: &Scene,
    settings: impl Iterator<Item = (&'a Study, usize)>,
    against: Against,
) {
    *html += "<div class=\"wide\"><table class=\"copy\"><tr><th>for a frame of</th><th>RMSE</th><th>FLIP</th><th>technique, \
              setting</th><th>write into the scene</th></tr>\n";
    for (study, place) in settings {
        let outcome = &study.outcomes[place];
        let (Some(seconds), Some(distance)) = (least_seconds(outcome), against.distance(outcome)) else { continue };
        let rmse = match against {
            Against::Limit => error_text(study, outcome).unwrap_or_default(),
            Against::Truth => format!("{:.1e}", distance.linear.rmse),
        };
        let written = lines(scene, &outcome.setting.request);
        let written = if written.is_empty() { "# as it is".to_owned() } else { written };
        let _ = writeln!(
            html,
            "<tr><td>{:.0} ms</td><td>{rmse}</td><td>{:.4}</td><td>{}, {}</td><td><pre>{}</pre></td></tr>",
            1e3 * seconds,
            distance.flip,
            study.technique,
            escaped(&outcome.setting.label),
            escaped(written.trim_end())
        );
    }
    *html += "</table></div>\n";
}

/// The RMSE of a setting against the limit in words: nothing is shown that the limit's own error could be.
pub(super) fn error_text(study: &Study, outcome: &Outcome) -> Option<String> {
    let rmse = outcome.from_limit.as_ref()?.linear.rmse;
    Some(match outcome.drawn {
        true => format!("{rmse:.2e}"),
        false if rmse == 0.0 => "none: the limit's picture".into(),
        false => format!("that of the limit, below {:.0e}", MARGIN * study.limit.own_error),
    })
}
