#version 450
// Resolves the opaque splats of each tile: all channels that shading gives.

#define CHANNELS MOST_CHANNELS

#include "blocks.glsl"
#include "layouts.glsl"
#include "splats.glsl"
#include "optics.glsl"
#include "resolve.glsl"
