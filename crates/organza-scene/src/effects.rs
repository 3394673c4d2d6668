//! Effects, and which of them a scene switches on or off: `render.effects`.

pub(crate) mod check;
pub(crate) mod kinds;
pub(crate) mod switched;
