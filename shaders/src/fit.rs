//! As much at once as a device has memory for.

use crate::DeviceError;

/// Attempts work on `most` items at once, and on half as many again and again while the device has no memory for them. So
/// many as `least` are not halved any more. Gives what the attempt gave, with the device's last refusal where it fits nowhere.
///
/// ```
/// use splat_shaders::{DeviceError, most_that_fits};
///
/// let attempt = |n: u32| {
///     let bytes = u64::from(n);
///     Ok::<_, ()>(if bytes > 300 { Err(DeviceError::Memory { bytes }) } else { Ok(n) })
/// };
/// assert_eq!(most_that_fits(1000, 100, attempt), Ok(Ok(250)));
/// assert_eq!(most_that_fits(1000, 600, attempt), Ok(Err(DeviceError::Memory { bytes: 500 })));
/// ```
///
/// # Errors
/// Those of the attempt which are not the device's: the outer ones.
pub fn most_that_fits<T, E>(
    mut most: u32,
    least: u32,
    mut attempt: impl FnMut(u32) -> Result<Result<T, DeviceError>, E>,
) -> Result<Result<T, DeviceError>, E> {
    loop {
        match attempt(most)? {
            Err(DeviceError::Memory { .. }) if most > least => most = most.div_ceil(2),
            done => return Ok(done),
        }
    }
}
