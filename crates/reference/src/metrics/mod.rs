//! Image metrics with the colour space in the type: an error of linear radiance and one of the displayed picture cannot
//! be mixed up.
//!
//! | metric | of | unit |
//! |---|---|---|
//! | [`compare`]: RMSE, bias, mean absolute, largest | either space | that of the image |
//! | [`psnr`] | displayed | dB, peak 1 |
//! | [`epsilon_8_bit`]: Zhang and Pajarola 2007, section 6.3 | displayed | sum of three 8-bit differences a pixel |
//! | [`Rays::disorder`]: wrong-order pairs, backtracks | an order of splats | pairs a ray, world units |
//! | [`flip`]: Andersson et al. 2020 | displayed | perceived difference, 0 to 1 |

mod errors;
mod flip;
mod flip_color;
mod flip_filter;
mod image;
mod order;

pub use errors::{Errors, compare, epsilon_8_bit, psnr};
pub use flip::{FlipMap, Viewing, flip};
pub use image::{ColorSpace, Display, Image, Linear, MetricError};
pub use order::{Disorder, Rays};
