//! A picture that is kept beside the present one, and the differences between the two.

use super::is_compared;
use crate::picture::{Drawn, Picture, Size};
use organza::Error;
use organza_judge::accuracy::{apart, difference_picture};
use serde::Serialize;
use std::sync::Arc;

/// A whole picture that was kept, as the page lists it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KeptRow {
    /// Number of the picture.
    pub number: u64,
    /// Name of its technique, or of several.
    pub technique: String,
    /// Its position between fast and exact.
    pub step: i32,
    /// Time of drawing, milliseconds.
    pub ms: f64,
    /// Its size.
    pub size: Size,
}

/// A whole picture that was kept.
#[derive(Debug)]
pub(crate) struct Kept {
    pub(crate) row: KeptRow,
    pub(crate) picture: Arc<Picture>,
    drawn: Arc<Drawn>,
}

/// The difference between the present picture and the kept one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Number of the picture that was kept.
    pub kept: u64,
    /// State that the present picture shows.
    pub generation: u64,
    /// Root mean square of the differences of displayed numbers, 0 to 1; `None` for pictures of two sizes, or of more than 4 million pixels.
    pub rmse: Option<f64>,
    /// Mean LDR-FLIP, 0 to 1.
    pub flip: Option<f64>,
    /// The difference picture shows differences so many times larger.
    pub gain: Option<f64>,
    /// The largest difference of the three channels, as a PNG file.
    #[serde(skip)]
    pub png: Vec<u8>,
}

impl Kept {
    pub(crate) fn new(drawn: Arc<Drawn>, picture: Arc<Picture>, step: i32) -> Self {
        let facts = &picture.facts;
        let technique = facts.technique.clone();
        let row = KeptRow { number: facts.number, technique, step, ms: facts.ms, size: facts.size };
        Self { row, picture, drawn }
    }

    /// Compares another whole picture with it.
    ///
    /// # Errors
    /// [`Error::Output`] for a picture that cannot be displayed.
    pub(crate) fn compared(&self, drawn: &Drawn) -> Result<Comparison, Error> {
        let Size { width, height } = drawn.size();
        let nothing = Comparison {
            kept: self.row.number,
            generation: drawn.generation,
            rmse: None,
            flip: None,
            gain: None,
            png: Vec::new(),
        };
        if self.row.size != drawn.size() || !is_compared(drawn.size()) {
            return Ok(nothing);
        }
        let before = self.drawn.displayed_as_shown()?;
        let now = drawn.displayed_as_shown()?;
        let distance = apart([width, height], &now, &before)?;
        let difference = difference_picture([width, height], &now, &before)?;
        Ok(Comparison {
            rmse: Some(distance.rmse),
            flip: Some(distance.flip),
            gain: Some(difference.gain),
            png: difference.png,
            ..nothing
        })
    }
}
