//! numpy arrays → columns. An array of any number type, with any strides, is read in one pass into the column that is drawn.

use crate::errors::{LimitError, refused};
use numpy::{Element, PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use splat_core::glam::{DVec3, Vec3};
use std::cell::Cell;

/// Rows of an array that are counted: indices of splats have 32 bits, and one object makes several of a point.
const MOST_ROWS: usize = i32::MAX as usize;

/// A number that an array may hold.
trait Number: Element + Copy {
    fn number(self) -> f64;
}

macro_rules! numbers {
    ($($kind:ty),*) => {$(
        impl Number for $kind {
            fn number(self) -> f64 {
                self as f64
            }
        }
    )*};
}
numbers!(f32, f64, i8, i16, i32, i64, u8, u16, u32, u64);

/// All numbers of an array, in C order whatever its strides, each as `made` makes it.
pub(crate) fn column<T>(name: &str, array: &Bound<'_, PyAny>, made: impl Fn(f64) -> T + Copy) -> PyResult<Vec<T>> {
    macro_rules! try_kinds {
        ($($kind:ty),*) => {$(
            if let Ok(array) = array.cast::<PyArrayDyn<$kind>>() {
                let array = array.try_readonly().map_err(|_| busy(name))?;
                let mut made_of = room(name, array.len())?;
                made_of.extend(array.as_array().iter().map(|value| made(value.number())));
                return Ok(made_of);
            }
        )*};
    }
    try_kinds!(f32, f64, i16, u8, i32, u16, i64, u32, i8, u64);
    Err(refused(name, "an array of numbers", &kind_of(array)))
}

/// Room for so many, or the error that there is none: nothing may end the interpreter.
fn room<T>(name: &str, count: usize) -> PyResult<Vec<T>> {
    let mut room = Vec::new();
    let bytes = count as u128 * size_of::<T>() as u128;
    let refused = |_| LimitError::new_err(format!("{name}: there is no memory of {bytes} bytes for its numbers"));
    room.try_reserve_exact(count).map_err(refused)?;
    Ok(room)
}

fn busy(name: &str) -> PyErr {
    refused(name, "an array that nobody writes to meanwhile", "one that is borrowed to be written")
}

fn kind_of(array: &Bound<'_, PyAny>) -> String {
    match array.cast::<PyUntypedArray>() {
        Ok(array) => format!("one of type {}", array.dtype()),
        Err(_) => array.get_type().to_string(),
    }
}

/// The sides of an array.
pub(crate) fn shape(name: &str, array: &Bound<'_, PyAny>) -> PyResult<Vec<usize>> {
    let array = array.cast::<PyUntypedArray>().map_err(|_| refused(name, "an array of numpy", &kind_of(array)))?;
    Ok(array.shape().to_vec())
}

/// The sides of an array as Python writes them.
pub(crate) fn shape_text(sides: &[usize]) -> String {
    match sides {
        [side] => format!("({side},)"),
        sides => format!("({})", sides.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
    }
}

/// The rows of an array of `rows` times `width` numbers.
pub(crate) fn check_rows(name: &str, array: &Bound<'_, PyAny>, rows: Option<usize>, width: usize) -> PyResult<usize> {
    let found = shape(name, array)?;
    let is_wide = match width {
        1 => found.len() == 1,
        width => found.len() == 2 && found[1] == width,
    };
    if !is_wide || rows.is_some_and(|rows| found[0] != rows) {
        let many = rows.map_or_else(|| "n".to_owned(), |rows| rows.to_string());
        let expected = if width == 1 { format!("the shape ({many},)") } else { format!("the shape ({many}, {width})") };
        return Err(refused(name, &expected, &shape_text(&found)));
    }
    if found[0] > MOST_ROWS {
        let found = found[0];
        return Err(LimitError::new_err(format!(
            "{name}: expected at most {MOST_ROWS} rows, found {found}; take a part of them"
        )));
    }
    Ok(found[0])
}

/// Rows of three numbers, each as `made` makes it, read in one pass.
fn rows<T>(
    name: &str,
    array: &Bound<'_, PyAny>,
    count: Option<usize>,
    made: impl Fn([f64; 3]) -> T + Copy,
) -> PyResult<Vec<T>> {
    let count = check_rows(name, array, count, 3)?;
    macro_rules! try_kinds {
        ($($kind:ty),*) => {$(
            if let Ok(array) = array.cast::<PyArrayDyn<$kind>>() {
                let array = array.try_readonly().map_err(|_| busy(name))?;
                let array = array.as_array();
                let mut rows = room(name, count)?;
                let mut numbers = array.iter().map(|value| value.number());
                while let (Some(x), Some(y), Some(z)) = (numbers.next(), numbers.next(), numbers.next()) {
                    rows.push(made([x, y, z]));
                }
                return Ok(rows);
            }
        )*};
    }
    try_kinds!(f32, f64, i16, u8, i32, u16, i64, u32, i8, u64);
    Err(refused(name, "an array of numbers", &kind_of(array)))
}

/// Positions, an array of n times 3.
pub(crate) fn positions(name: &str, array: &Bound<'_, PyAny>) -> PyResult<Vec<DVec3>> {
    rows(name, array, None, DVec3::from_array)
}

/// Vectors of single precision, one a row.
pub(crate) fn vectors(name: &str, array: &Bound<'_, PyAny>, count: usize) -> PyResult<Vec<Vec3>> {
    rows(name, array, Some(count), |row| DVec3::from_array(row).as_vec3())
}

/// Colours, one a row: linear numbers, or numbers of sRGB where the array is of bytes or of two bytes each.
pub(crate) fn colors(name: &str, array: &Bound<'_, PyAny>, count: usize) -> PyResult<Vec<[f32; 3]>> {
    if is_of_two_bytes(array) {
        let linear = |value: f64| splat_core::srgb::decoded(value / f64::from(u16::MAX)) as f32;
        return rows(name, array, Some(count), |row| row.map(linear));
    }
    if !is_bytes(array) {
        return rows(name, array, Some(count), |row| row.map(|value| value as f32));
    }
    let linear: Vec<f32> = (0..=255).map(|byte| splat_core::srgb::decoded(f64::from(byte) / 255.0) as f32).collect();
    // A byte is an index of 256 entries.
    rows(name, array, Some(count), |row| row.map(|byte| linear[byte as usize]))
}

/// Whether an array is of bytes, which are colours of sRGB.
pub(crate) fn is_bytes(array: &Bound<'_, PyAny>) -> bool {
    array.cast::<PyArrayDyn<u8>>().is_ok()
}

/// Whether an array is of whole numbers of 16 bits, which are colours of sRGB too.
pub(crate) fn is_of_two_bytes(array: &Bound<'_, PyAny>) -> bool {
    array.cast::<PyArrayDyn<u16>>().is_ok()
}

/// Indices of vertices, three a triangle; the first that no vertex has is named.
pub(crate) fn triangles(name: &str, array: &Bound<'_, PyAny>, vertices: usize) -> PyResult<Vec<[u32; 3]>> {
    let wrong = Cell::new(None);
    let place = Cell::new(0_usize);
    let is_index = |value: f64| value >= 0.0 && value < vertices as f64 && value.fract() == 0.0;
    let faces = rows(name, array, None, |face| {
        if wrong.get().is_none() {
            wrong.set(face.into_iter().find(|value| !is_index(*value)).map(|value| (value, place.get())));
        }
        place.set(place.get() + 1);
        face.map(|index| index as u32)
    })?;
    match wrong.get() {
        Some((value, face)) => {
            let expected = format!("indices of {vertices} vertices, from 0");
            Err(refused(name, &expected, &format!("{value} in face {face}")))
        }
        None => Ok(faces),
    }
}
