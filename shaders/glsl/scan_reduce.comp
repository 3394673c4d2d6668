#version 450
// The sum of each block of 1024 numbers. First step of a reduce-then-scan, which needs no workgroup to wait for another.

#define PLACE gl_LocalInvocationIndex

#include "blocks.glsl"
#include "layouts.glsl"
#include "scan.glsl"
#include "scan_reduce.glsl"
