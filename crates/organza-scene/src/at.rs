//! A place in the document, and checks of what is written there: the tools of the checks of all tables.

use crate::limits::{LARGEST, LARGEST_INTENSITY, MOST_SAMPLES, SMALLEST};
use crate::text::tree::{Document, Node, Step};
use crate::{Error, Written, short};
use glam::DVec3;
use std::ops::RangeInclusive;

/// A place in the document, for error messages.
#[derive(Debug, Clone)]
pub(crate) struct At<'a> {
    pub(crate) document: &'a Document<'a>,
    path: Vec<Step<'a>>,
}

impl<'a> At<'a> {
    /// The whole document.
    pub(crate) fn root(document: &'a Document<'a>) -> Self {
        Self { document, path: Vec::new() }
    }

    pub(crate) fn key(&self, key: &'a str) -> Self {
        let mut path = self.path.clone();
        path.push(Step::Key(key));
        Self { document: self.document, path }
    }

    pub(crate) fn index(&self, index: usize) -> Self {
        let mut path = self.path.clone();
        path.push(Step::Index(index));
        Self { document: self.document, path }
    }

    pub(crate) fn error(&self, message: impl Into<String>, hint: impl Into<String>) -> Error {
        self.document.error(self.document.place_of(&self.path), message, hint)
    }

    /// An error at a column (from 1) of the text `value` that is written here.
    pub(crate) fn error_in_text(&self, value: &str, column: usize, message: String, hint: &str) -> Error {
        let place = self.document.place_in_text(self.document.place_of(&self.path), value, column);
        self.document.error(place, message, hint)
    }

    /// The value that is written here, or the deepest on the way to it that is.
    pub(crate) fn node(&self) -> &'a Node {
        self.document.node_of(&self.path)
    }

    /// The place as it is told once the document is gone.
    pub(crate) fn written(&self) -> Written {
        self.document.written(self.document.place_of(&self.path))
    }

    /// The place in words.
    pub(crate) fn name(&self) -> String {
        self.document.name_place(self.document.place_of(&self.path))
    }

    /// `value` if it lies in `range`.
    pub(crate) fn number(&self, key: &'a str, value: f64, range: RangeInclusive<f64>) -> Result<f64, Error> {
        if range.contains(&value) {
            return Ok(value);
        }
        let low = range.start();
        let high = range.end();
        let expected = match (*low, *high) {
            (SMALLEST, LARGEST) => format!("a number above 0, from {SMALLEST:e} to {LARGEST:e}"),
            (0.0, LARGEST) => format!("a number from 0 to {LARGEST:e}"),
            _ => format!("a number from {} to {}", short(*low), short(*high)),
        };
        Err(self.key(key).error(format!("`{key}`: expected {expected}, found {}", short(value)), ""))
    }

    /// A whole number in a range.
    pub(crate) fn whole(&self, key: &'a str, value: u32, range: RangeInclusive<u32>) -> Result<u32, Error> {
        if range.contains(&value) {
            return Ok(value);
        }
        let expected = format!("a whole number from {} to {}", range.start(), range.end());
        Err(self.key(key).error(format!("`{key}`: expected {expected}, found {value}"), ""))
    }

    /// A length above 0.
    pub(crate) fn length(&self, key: &'a str, value: f64) -> Result<f64, Error> {
        self.number(key, value, SMALLEST..=LARGEST)
    }

    /// Three numbers of any sign.
    pub(crate) fn vector(&self, key: &'a str, value: [f64; 3]) -> Result<DVec3, Error> {
        for x in value {
            if x.abs() > LARGEST {
                let message = format!("`{key}`: expected numbers from -{LARGEST:e} to {LARGEST:e}, found {}", short(x));
                return Err(self.key(key).error(message, ""));
            }
        }
        Ok(DVec3::from_array(value))
    }

    /// A direction of any length but 0, made a unit vector.
    pub(crate) fn direction(&self, key: &'a str, value: [f64; 3]) -> Result<DVec3, Error> {
        let v = self.vector(key, value)?;
        // Scaled first, so that small numbers do not vanish when squared.
        let largest = v.abs().max_element();
        if largest == 0.0 {
            return Err(self.key(key).error(format!("`{key}`: expected a direction, found {value:?}"), ""));
        }
        Ok((v / largest).normalize())
    }

    /// Three numbers ≥ 0.
    pub(crate) fn color(&self, key: &'a str, value: [f64; 3]) -> Result<[f32; 3], Error> {
        self.colors_up_to(key, value, LARGEST_INTENSITY)
    }

    /// Three numbers from 0 to `most`.
    pub(crate) fn colors_up_to(&self, key: &'a str, value: [f64; 3], most: f64) -> Result<[f32; 3], Error> {
        for (i, x) in value.into_iter().enumerate() {
            if !(0.0..=most).contains(&x) {
                let message = format!("`{key}`: expected numbers from 0 to {most:e}, found {}", short(x));
                return Err(self.key(key).index(i).error(message, ""));
            }
        }
        Ok(value.map(|x| x as f32))
    }

    /// The distance between samples of a region whose longest side is `longest`, from its own key.
    pub(crate) fn spacing(&self, key: &'a str, value: f64, longest: f64) -> Result<f64, Error> {
        self.length(key, value)?;
        if longest / value > MOST_SAMPLES {
            let least = longest / MOST_SAMPLES;
            let message = format!("`{key}`: expected at least {least} for a side of {longest}, found {value}");
            return Err(self.key(key).error(message, format!("a side may have {MOST_SAMPLES} samples")));
        }
        Ok(value)
    }
}
