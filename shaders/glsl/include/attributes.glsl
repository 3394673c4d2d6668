// What the kernels of projection and shading share: the words of a splat as it is uploaded.

// Positions: 3 f32. Radii: of the kernel, of the sphere that holds the splat (2 f32). Looks: cross-section (f32),
// material | footprint << 16 | kind << 24, colour (3 f32). Frames, where the cloud has them: normal (3 f32), and semi-axis
// of the disc (3 f32), and normal of shading (3 f32), zero where it is the normal.
const uint LOOK_WORDS = 5u;
const uint LOOK_TABLES = 1u;
const uint LOOK_COLOR = 2u;
const uint TANGENT_WORD = 3u;
const uint SHADING_WORD = 6u;

const uint MEDIUM = 0u;
const uint SURFACE = 1u;
const uint OPAQUE = 2u;
