#version 450
// Resolves the opaque splats of each tile: three channels, which most pictures have.

#define CHANNELS 3u

#include "blocks.glsl"
#include "layouts.glsl"
#include "splats.glsl"
#include "optics.glsl"
#include "resolve.glsl"
