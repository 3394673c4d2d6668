#version 450
// Composites the splats of each tile: one plane of optical depth and three channels, which most pictures have.

#define PLANES 1u
#define CHANNELS 3u

#include "blocks.glsl"
#include "layouts.glsl"
#include "splats.glsl"
#include "optics.glsl"
#include "composite.glsl"
