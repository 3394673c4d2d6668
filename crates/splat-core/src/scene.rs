//! What surrounds and colours the data: camera, lights, environment, materials, transfer functions.

pub(crate) mod camera;
pub(crate) mod environment;
pub(crate) mod light;
pub(crate) mod material;
pub(crate) mod phase;
pub(crate) mod transfer;
pub(crate) mod turns;
