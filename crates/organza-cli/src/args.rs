//! The arguments, as the user writes them.

use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

/// Most threads that are worth a try.
const MOST_THREADS: u64 = 1024;

/// Renders mixed, translucent 3D data by splatting.
#[derive(Debug, Parser)]
#[command(name = "organza", version, disable_help_subcommand = true)]
pub(super) struct Arguments {
    #[command(subcommand)]
    pub(super) command: Command,
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Renders a scene to EXR or PNG files.
    Render(RenderArguments),
    /// Says what a render would simulate, what not, and why.
    Explain(ExplainArguments),
    /// Measures what each approximation costs in accuracy and saves in time; writes a report.
    Accuracy(AccuracyArguments),
    /// Draws a scene by every ordering there is; writes a comparison.
    Orders(OrdersArguments),
    /// Describes a data file or a scene.
    Info(InfoArguments),
    /// Lists the GPUs that --backend can use, and the drivers that play one.
    Devices(DevicesArguments),
    /// Runs every GPU recording on every device and compares with the processor.
    Passport(PassportArguments),
    /// Prints the JSON Schema of scene files.
    Schema,
}

impl Command {
    /// Whether stdout has to carry one JSON document.
    pub(super) fn wants_json(&self) -> bool {
        match self {
            Self::Render(a) => a.scene.json,
            Self::Explain(a) => a.scene.json,
            Self::Accuracy(a) => a.scene.json,
            Self::Orders(a) => a.scene.json,
            Self::Info(a) => a.json,
            Self::Devices(a) => a.json,
            Self::Passport(a) => a.json,
            Self::Schema => false,
        }
    }
}

/// What all commands on a scene share.
#[derive(Debug, Args)]
pub(super) struct SceneArguments {
    /// Scene file: TOML, or JSON if its name ends in .json
    pub(super) scene: PathBuf,
    /// Change a value of the scene before it is checked, such as render.points.exact=true or object.cloud.visible=false
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub(super) set: Vec<String>,
    /// Technique: auto, points, particles, sheets, surfels or reference
    #[arg(long, value_name = "NAME")]
    pub(super) technique: Option<String>,
    /// What computes; `render` alone takes another than cpu
    #[arg(long, value_enum, default_value_t = Backend::Cpu)]
    pub(super) backend: Backend,
    /// Part of the name of the GPU for --backend auto, ash or wgpu [default: the best, never a software driver]
    #[arg(long, value_name = "NAME", value_parser = parse_device)]
    pub(super) device: Option<String>,
    /// The GPU composites the splats too; beauty then differs from the processor's by rounding, up to 1e-5
    #[arg(long)]
    pub(super) device_composites: bool,
    /// Size of the picture, pixels
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub(super) size: Option<[i64; 2]>,
    /// Seed of everything random
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(i64).range(0..))]
    pub(super) seed: Option<i64>,
    /// Threads; 0 takes one for each core
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u64).range(0..=MOST_THREADS))]
    pub(super) threads: u64,
    /// Largest change of a displayed pixel (0 to 1) by what is not simulated
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = parse_finite)]
    pub(super) tolerance: Option<f64>,
    /// Standard error of luminance at which the technique `particles` has averaged enough sets
    #[arg(long, value_name = "E", allow_negative_numbers = true, value_parser = parse_finite)]
    pub(super) target_error: Option<f64>,
    /// Most sets that the technique `particles` averages
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(i64).range(0..))]
    pub(super) repeat_level: Option<i64>,
    /// Exposure of PNG files, stops; EXR files keep radiance
    #[arg(long, value_name = "EV", allow_negative_numbers = true, value_parser = parse_finite)]
    pub(super) exposure: Option<f64>,
    /// Images to keep besides beauty and alpha, such as direct,shadow,depth
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub(super) layers: Option<Vec<String>>,
    /// Bytes that all buffers together may take, such as 8G [default: three quarters of the memory]
    #[arg(long, value_name = "BYTES", value_parser = parse_bytes)]
    pub(super) max_memory: Option<u64>,
    /// Leave out points that are not finite instead of refusing their file; meshes are refused all the same
    #[arg(long)]
    pub(super) drop_invalid: bool,
    /// Refuse files with faults that could be mended, such as a face that crosses itself
    #[arg(long)]
    pub(super) strict: bool,
    /// Make points of a `points` object at one place one
    #[arg(long)]
    pub(super) merge_duplicates: bool,
    /// Allow data outside the scene's root folder
    #[arg(long)]
    pub(super) allow_path: bool,
    /// Print one JSON document on stdout
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Debug, Args)]
pub(super) struct RenderArguments {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    /// Output, .exr or .png; several are allowed [default: the scene's name with .exr, in this folder]
    #[arg(short, long = "output", value_name = "FILE")]
    pub(super) output: Vec<PathBuf>,
    /// Keep the sums of the technique `particles` in a file, and go on from it if it is there
    #[arg(long, value_name = "FILE")]
    pub(super) checkpoint: Option<PathBuf>,
    /// Draw frames of the scene's animation, all or FIRST-LAST, to numbered files such as picture.0007.exr
    #[arg(long, value_name = "FIRST-LAST", num_args = 0..=1, require_equals = true, default_missing_value = "all",
          value_parser = parse_frames)]
    pub(super) frames: Option<Frames>,
    /// Store colours, alpha and shadow of EXR files in 16 bits
    #[arg(long)]
    pub(super) half: bool,
    /// Write what the render cost to a JSON file
    #[arg(long, value_name = "FILE.json")]
    pub(super) cost: Option<PathBuf>,
    /// Replace outputs that exist
    #[arg(long)]
    pub(super) force: bool,
}

#[derive(Debug, Args)]
pub(super) struct ExplainArguments {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    /// Render too, and say what each pass cost
    #[arg(long)]
    pub(super) measure: bool,
}

#[derive(Debug, Args)]
pub(super) struct AccuracyArguments {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    /// Folder for accuracy.json, accuracy.csv and accuracy.html; made if it is not there
    #[arg(short = 'o', long, value_name = "DIR", default_value = ".")]
    pub(super) out: PathBuf,
    /// A small picture, few steps and repeats
    #[arg(long)]
    pub(super) quick: bool,
    /// Double the end of every knob so many times, for a better reference
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=4))]
    pub(super) finer: u32,
    /// Replace outputs that exist
    #[arg(long)]
    pub(super) force: bool,
}

#[derive(Debug, Args)]
pub(super) struct OrdersArguments {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    /// Folder for orders.json, orders.csv, orders.html and orders.png; made if it is not there
    #[arg(short = 'o', long, value_name = "DIR", default_value = ".")]
    pub(super) out: PathBuf,
    /// Replace outputs that exist
    #[arg(long)]
    pub(super) force: bool,
}

#[derive(Debug, Args)]
pub(super) struct InfoArguments {
    /// Data file, or scene (.toml, .json)
    pub(super) file: PathBuf,
    /// Refuse a data file with faults that could be mended
    #[arg(long)]
    pub(super) strict: bool,
    /// Allow data outside the scene's root folder
    #[arg(long)]
    pub(super) allow_path: bool,
    /// Print one JSON document on stdout
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Debug, Args)]
pub(super) struct DevicesArguments {
    /// Print one JSON document on stdout
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Debug, Args)]
pub(super) struct PassportArguments {
    /// Part of the names of the devices [default: all, software drivers too]
    #[arg(long, value_name = "NAME", value_parser = parse_device)]
    pub(super) device: Option<String>,
    /// Print one JSON document on stdout
    #[arg(long)]
    pub(super) json: bool,
}

/// What computes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Backend {
    /// A real GPU, where there is one, helps as by `ash` or `wgpu`; else the processor draws alone
    Auto,
    /// The processor
    Cpu,
    /// A GPU by wgpu helps as by `ash`
    Wgpu,
    /// A GPU by Vulkan orders the translucent splats or lights and averages particles, the processor does the rest
    Ash,
}

impl Backend {
    /// As the user writes it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Cpu => "cpu",
            Self::Wgpu => "wgpu",
            Self::Ash => "ash",
        }
    }
}

/// Frames to draw.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Frames {
    /// All that the scene has.
    All,
    /// From the first to the last, which is one of them.
    Range(u32, u32),
}

fn parse_frames(text: &str) -> Result<Frames, String> {
    if text == "all" {
        return Ok(Frames::All);
    }
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    match (first.parse(), last.parse()) {
        (Ok(first), Ok(last)) if first <= last => Ok(Frames::Range(first, last)),
        _ => Err("expected FIRST-LAST, such as 0-47, or one frame".into()),
    }
}

fn parse_size(text: &str) -> Result<[i64; 2], String> {
    let sides = text.split_once(['x', 'X']).and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    sides.ok_or_else(|| "expected WIDTHxHEIGHT, such as 960x540".into())
}

/// Part of the name of a device, which drivers give 256 bytes at most.
fn parse_device(text: &str) -> Result<String, String> {
    let fits = text.len() <= 200;
    fits.then(|| text.to_owned()).ok_or_else(|| "expected a part of a device's name, of 200 bytes at most".into())
}

fn parse_finite(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(|| "expected a finite number".into())
}

/// A number of bytes with an optional K, M, G or T (powers of 1024).
fn parse_bytes(text: &str) -> Result<u64, String> {
    let (digits, shift) = match text.chars().last().map(|c| c.to_ascii_uppercase()) {
        Some('K') => (&text[..text.len() - 1], 10),
        Some('M') => (&text[..text.len() - 1], 20),
        Some('G') => (&text[..text.len() - 1], 30),
        Some('T') => (&text[..text.len() - 1], 40),
        _ => (text, 0),
    };
    let bytes = digits.parse::<u64>().ok().and_then(|n| n.checked_mul(1 << shift)).filter(|n| *n > 0);
    bytes.ok_or_else(|| "expected a number of bytes above 0, such as 500M or 8G".into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_arguments_are_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn sizes_and_bytes_are_read() {
        assert_eq!(parse_size("960x540"), Ok([960, 540]));
        assert!(["", "960", "x", "9x9x9", "1e3x2", " 9x9"].iter().all(|t| parse_size(t).is_err()));
        assert_eq!(parse_bytes("8G"), Ok(8 << 30));
        assert_eq!(parse_frames("all"), Ok(Frames::All));
        assert_eq!([parse_frames("0-47"), parse_frames("9")], [Ok(Frames::Range(0, 47)), Ok(Frames::Range(9, 9))]);
        assert!(["", "-", "5-", "-1", "5-4", "1..4", "a"].iter().all(|t| parse_frames(t).is_err()));
        assert_eq!(parse_bytes("123"), Ok(123));
        assert!(["", "0", "-1", "G", "1.5G", "99999999999T", "1ü"].iter().all(|t| parse_bytes(t).is_err()));
    }
}
