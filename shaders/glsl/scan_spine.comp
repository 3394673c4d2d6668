#version 450
// The exclusive scan of the blocks' sums by one workgroup, and the total.

#define PLACE gl_LocalInvocationIndex

#include "blocks.glsl"
#include "layouts.glsl"
#include "scan.glsl"
#include "scan_spine.glsl"
