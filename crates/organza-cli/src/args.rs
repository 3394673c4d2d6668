//! The arguments, as the user writes them.

mod parse;

use clap::{Args, Parser, Subcommand, ValueEnum};
#[cfg(feature = "view")]
use parse::parse_address;
use parse::{
    parse_budget, parse_bytes, parse_color, parse_device, parse_error_limit, parse_finite, parse_frames, parse_range,
    parse_size,
};
#[cfg(feature = "view")]
use std::net::SocketAddr;
use std::path::PathBuf;

/// Most threads that are worth a try.
pub(super) const MOST_THREADS: u64 = 1024;

/// What a first look at the command shows.
const EXAMPLES: &str = "Examples:
  organza render bunny.ply -o bunny.png      a picture of a data file
  organza init bunny.ply -o scene.toml       a scene of it, ready to edit
  organza render scene.toml -o picture.png   the same picture
  organza info bunny.ply                     what the file holds";

/// Renders mixed, translucent 3D data by splatting.
#[derive(Debug, Parser)]
#[command(name = "organza", version, disable_help_subcommand = true, after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// Print no notes, no progress and no account of what was done: warnings, errors and --json alone
    #[arg(short, long, global = true)]
    pub(super) quiet: bool,
    /// Print each stage of the work as it begins, with the time since the start
    #[arg(short, long, global = true, conflicts_with = "quiet")]
    pub(super) verbose: bool,
    #[command(subcommand)]
    pub(super) command: Command,
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Renders a scene, or data files as they are, to EXR or PNG files.
    #[command(
        after_help = "Examples:\n  organza render bunny.ply -o bunny.png\n  organza render head.nii.gz --preset mri --azimuth 200 -o head.png\n  organza render ground.laz bunny.ply --ground -o both.png\n  organza render ground.laz --color-by height --legend -o heights.png\n  organza render scene.toml -o picture.exr -o picture.png --layers effects,depth\n  organza render bunny.ply --material wax --ground -o wax.png\n  organza render bunny.ply -o around.mp4 --turntable 100\n  organza render scene.toml --set object.bunny.opacity=0.4 --technique surfels -o glass.png"
    )]
    Render(RenderArguments),
    /// Writes a first scene of data files, with comments, ready to edit.
    #[command(
        after_help = "Examples:\n  organza init bunny.ply -o scene.toml\n  organza init head.nii.gz --preset ct-bone -o head.toml\n  organza init ground.laz bunny.ply --ground --elevation 35"
    )]
    Init(InitArguments),
    /// Writes the splats of a scene or of data files as rendering-oriented points, which `render` reads again.
    #[command(
        after_help = "Examples:\n  organza convert scene.toml -o splats.ply\n  organza convert bunny.ply -o splats.ply\n  organza render splats.ply -o splats.png"
    )]
    Convert(ConvertArguments),
    /// Writes the surface that a light sees first, from its shadow map, as points with normals, which `points` of a scene reads.
    #[command(
        after_help = "Examples:\n  organza extract scene.toml --absorbance 0.5 -o skin.ply\n  organza extract scene.toml --light 1 -o lit.ply"
    )]
    Extract(ExtractArguments),
    /// Says what a render would simulate, what not, and why.
    #[command(
        after_help = "Examples:\n  organza explain scene.toml\n  organza explain scene.toml --measure --json\n  organza explain bunny.ply"
    )]
    Explain(ExplainArguments),
    /// Measures what each approximation costs in accuracy and saves in time; writes a report.
    #[command(after_help = "Examples:\n  organza accuracy scene.toml --quick -o report")]
    Accuracy(AccuracyArguments),
    /// Draws a scene by every ordering there is; writes a comparison.
    #[command(after_help = "Examples:\n  organza orders scene.toml --quick -o orders")]
    Orders(OrdersArguments),
    /// Describes a data file or a scene.
    #[command(
        after_help = "Examples:\n  organza info bunny.ply\n  organza info head.nii.gz --json\n  organza info scene.toml"
    )]
    Info(InfoArguments),
    /// Measures how long each kind of work takes on this machine, for predicted times; takes less than a minute.
    #[command(
        after_help = "Examples:\n  organza calibrate -o machine.json\n  organza explain scene.toml --machine machine.json"
    )]
    Calibrate(CalibrateArguments),
    /// Lists the GPUs that --backend can use, and the drivers that play one.
    #[command(after_help = "Examples:\n  organza devices\n  organza devices --json")]
    Devices(DevicesArguments),
    /// Runs every GPU recording on every device and compares with the processor.
    #[command(after_help = "Examples:\n  organza passport\n  organza passport --device llvmpipe")]
    Passport(PassportArguments),
    /// Shows a scene, or data files, on a page of the browser: to turn it, change it, and see what each effect is for.
    #[cfg(feature = "view")]
    #[command(
        after_help = "Examples:\n  organza view bunny.ply\n  organza view scene.toml --size 640x360\n  organza view scene.toml --no-open --listen 127.0.0.1:8000"
    )]
    View(ViewArguments),
    /// Prints what completes the arguments of this command in a shell.
    #[command(
        after_help = "Examples:\n  organza completions bash > ~/.local/share/bash-completion/completions/organza\n  organza completions zsh > ~/.zfunc/_organza"
    )]
    Completions(CompletionsArguments),
    /// Prints the manual page of this command, or of one of its commands.
    #[command(
        after_help = "Examples:\n  organza man > organza.1\n  organza man render > organza-render.1\n  organza man render | man -l -"
    )]
    Man(ManArguments),
    /// Prints the JSON Schema of scene files.
    #[command(after_help = "Examples:\n  organza schema > scene.schema.json")]
    Schema,
}

impl Command {
    /// Whether stdout has to carry one JSON document.
    pub(super) fn wants_json(&self) -> bool {
        match self {
            Self::Render(a) => a.scene.common.json,
            Self::Init(a) => a.common.json,
            Self::Convert(a) => a.scene.common.json,
            Self::Extract(a) => a.scene.common.json,
            Self::Explain(a) => a.scene.common.json,
            Self::Accuracy(a) => a.scene.common.json,
            Self::Orders(a) => a.scene.common.json,
            Self::Info(a) => a.json,
            Self::Calibrate(a) => a.json,
            Self::Devices(a) => a.json,
            Self::Passport(a) => a.json,
            #[cfg(feature = "view")]
            Self::View(a) => a.scene.common.json,
            Self::Completions(_) | Self::Man(_) | Self::Schema => false,
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct CompletionsArguments {
    /// The shell
    #[arg(value_name = "SHELL")]
    pub(super) shell: clap_complete::Shell,
}

#[derive(Debug, Args)]
pub(super) struct ManArguments {
    /// One of the commands, such as render
    #[arg(value_name = "COMMAND")]
    pub(super) command: Option<String>,
}

/// An axis that may point up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Axis {
    /// As meshes mostly have it
    Y,
    /// As surveys and scans of bodies have it
    Z,
    /// The other way, as captured 3D Gaussians mostly have it
    #[value(name = "-y")]
    MinusY,
}

/// How data files without a scene are to be seen.
#[derive(Debug, Default, Args)]
pub(super) struct FirstArguments {
    /// Where the eye is, degrees about the axis that points up [default: 30; 150 for scans of bodies]
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = parse_finite)]
    pub(super) azimuth: Option<f64>,
    /// Degrees above the horizon [default: 15 to 40, the flatter the data the higher]
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = parse_finite)]
    pub(super) elevation: Option<f64>,
    /// Share of the picture's width or height that is filled, above 0, at most 1 [default: 0.9]
    #[arg(long, value_name = "SHARE", value_parser = parse_finite)]
    pub(super) fit: Option<f64>,
    /// Look of volumes, and the colour map of --color-by: ct-bone, ct-skin, mri, cloud, labels, viridis, magma, inferno, plasma, cividis, turbo, grey, coolwarm, or a .json preset of ParaView
    #[arg(long, value_name = "NAME")]
    pub(super) preset: Option<String>,
    /// Material of all surfaces, and of points and volumes that are a medium: glass, glass-red, water, wax, skin, milk, marble, smoke, cloud and others,
    /// which docs/materials.md shows
    #[arg(long, value_name = "NAME")]
    pub(super) material: Option<String>,
    /// Column that points or meshes take their colours from, one of those that `organza info` lists, or array of a VTK volume; --preset names
    /// the colour map [default: the file's colours; of a LAS file without colours its classes where most points have one, else its values]
    #[arg(long, value_name = "COLUMN")]
    pub(super) color_by: Option<String>,
    /// Numbers at the two ends of the colour map of --color-by [default: the 1st and the 99th percentile of the column]
    #[arg(long, value_name = "LOW,HIGH", allow_hyphen_values = true, value_parser = parse_range, requires = "color_by")]
    pub(super) color_range: Option<[f64; 2]>,
    /// The colour map of --color-by goes by logarithms: numbers that are not above 0 have the object's colour
    #[arg(long, requires = "color_by")]
    pub(super) log: bool,
    /// Names, colours and opacities of the labels of volumes: a .ctbl of 3D Slicer, a .lut or .txt of FreeSurfer, ITK-SNAP or FSL, or a .toml file
    #[arg(long, value_name = "FILE")]
    pub(super) labels: Option<PathBuf>,
    /// Axis of the data that points up [default: what the format of each file says, else y]
    #[arg(long, value_enum, allow_hyphen_values = true)]
    pub(super) up: Option<Axis>,
    /// Stand all of it on a ground
    #[arg(long)]
    pub(super) ground: bool,
}

/// What all commands that read data for a picture share.
#[derive(Debug, Args)]
pub(super) struct CommonArguments {
    /// Size of the picture, pixels
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub(super) size: Option<[i64; 2]>,
    /// Threads; 0 takes one for each core
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u64).range(0..=MOST_THREADS))]
    pub(super) threads: u64,
    /// Bytes that all buffers together may take, such as 8G [default: three quarters of the memory]
    #[arg(long, value_name = "BYTES", value_parser = parse_bytes)]
    pub(super) max_memory: Option<u64>,
    /// Leave out points that are not finite instead of refusing their file; meshes are refused all the same
    #[arg(long)]
    pub(super) drop_invalid: bool,
    /// Refuse files with faults that could be mended, such as a face that crosses itself
    #[arg(long)]
    pub(super) strict: bool,
    /// Print one JSON document on stdout
    #[arg(long)]
    pub(super) json: bool,
}

/// What all commands on a scene share.
#[derive(Debug, Args)]
pub(super) struct SceneArguments {
    /// Scene file, .toml or .json; or data files, drawn as `organza init` writes them
    #[arg(required = true, value_name = "SCENE|FILE")]
    pub(super) inputs: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) first: FirstArguments,
    /// Change a value of the scene before it is checked, such as render.points.exact=true or object.cloud.visible=false; in order, before other options
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub(super) set: Vec<String>,
    /// Switch an effect that `organza explain` lists on or off whatever it changes, such as shadow.sun=off
    #[arg(long = "effect", value_name = "NAME=on|off")]
    pub(super) effect: Vec<String>,
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
    /// Seed of everything random
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(i64).range(0..))]
    pub(super) seed: Option<i64>,
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
    /// Colour of the background: a name such as white, black, grey or skyblue, or #rrggbb, as it is displayed without exposure
    #[arg(long, value_name = "COLOUR", value_parser = parse_color)]
    pub(super) background: Option<[f32; 3]>,
    /// Images to keep besides beauty and alpha, such as direct,shadow,depth
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub(super) layers: Option<Vec<String>>,
    /// Folder for what converting large clouds of points finds out, which the next run reads; no picture depends on it
    #[arg(long, value_name = "DIR")]
    pub(super) cache: Option<PathBuf>,
    /// Bytes that the files of --cache may take; those that were not used for longest go first
    #[arg(long, value_name = "BYTES", default_value = "8G", value_parser = parse_bytes, requires = "cache")]
    pub(super) cache_size: u64,
    /// Make points of a `points` object at one place one
    #[arg(long)]
    pub(super) merge_duplicates: bool,
    /// Allow data outside the scene's root folder
    #[arg(long, conflicts_with = "sandbox")]
    pub(super) allow_path: bool,
    /// Forbid data outside the scene's root folder even where the scene allows it by its key `root`: for scenes of strangers
    #[arg(long)]
    pub(super) sandbox: bool,
    #[command(flatten)]
    pub(super) common: CommonArguments,
}

/// What a picture is to keep to, where settings may give way for it.
#[derive(Debug, Args)]
pub(super) struct GoalArguments {
    /// Draw within so many milliseconds from files read to picture finished, on the threads of --threads: samples of a pixel, splats and sets of
    /// particles give way as far as they have to, and which did is told
    #[arg(long, value_name = "MS", value_parser = parse_budget, allow_negative_numbers = true,
          conflicts_with_all = ["frames", "turntable", "checkpoint"])]
    pub(super) budget: Option<u64>,
    /// Draw as fast as an RMSE of the displayed picture of at most E allows (0 to 1, against the scene's own settings): the same settings give way.
    /// It is an estimate from small pictures, mostly within a factor of 2: too high of fewer samples where all is smooth edges, too low of fine detail.
    /// --tolerance is another thing, a proven bound of what is not simulated, and --target-error the noise of particles
    #[arg(long, value_name = "E", value_parser = parse_error_limit, allow_negative_numbers = true,
          conflicts_with_all = ["frames", "turntable", "checkpoint"])]
    pub(super) max_rmse: Option<f64>,
    /// The same by the mean FLIP, the difference that is seen (0 to 1); with --max-rmse and --budget all hold, or the nearest is named
    #[arg(long, value_name = "E", value_parser = parse_error_limit, allow_negative_numbers = true,
          conflicts_with_all = ["frames", "turntable", "checkpoint"])]
    pub(super) max_flip: Option<f64>,
}

#[derive(Debug, Args)]
pub(super) struct RenderArguments {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    /// Output, .png, .exr, .jpg or .webp, or of frames a film, .mp4, .webm or .gif, by ffmpeg; several are allowed [default: the scene's name with .png, or .exr where --layers or --half ask for what it alone
    /// holds, in this folder]
    #[arg(short, long = "output", value_name = "FILE")]
    pub(super) output: Vec<PathBuf>,
    /// Keep the sums of the technique `particles` in a file, and go on from it if it is there
    #[arg(long, value_name = "FILE")]
    pub(super) checkpoint: Option<PathBuf>,
    /// Draw frames of the scene's animation, all or FIRST-LAST, to numbered files such as picture.0007.exr
    #[arg(long, value_name = "FIRST-LAST", num_args = 0..=1, require_equals = true, default_missing_value = "all",
          value_parser = parse_frames)]
    pub(super) frames: Option<Frames>,
    /// Draw so many frames in a circle around all, to numbered files
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(super) turntable: Option<u32>,
    /// Frames of a second of a film [default: 25]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=240))]
    pub(super) fps: Option<u32>,
    #[command(flatten)]
    pub(super) goal: GoalArguments,
    /// Write files with the opacity of each pixel in the place of the background: premultiplied in EXR, straight in PNG and WebP
    #[arg(long)]
    pub(super) transparent: bool,
    /// Draw into displayed pictures (PNG, JPEG, WebP, films) what colours stand for: the maps of points by a column, the transfer functions of volumes
    #[arg(long)]
    pub(super) legend: bool,
    /// Write PNG files with 16 bits a channel instead of 8
    #[arg(long)]
    pub(super) deep: bool,
    /// Store colours, alpha and shadow of EXR files in 16 bits
    #[arg(long)]
    pub(super) half: bool,
    /// Figures of this machine for predicted times, as `organza calibrate` wrote them [default: built-in figures]
    #[arg(long, value_name = "FILE")]
    pub(super) machine: Option<PathBuf>,
    /// Write what the render cost to a JSON file
    #[arg(long, value_name = "FILE.json")]
    pub(super) cost: Option<PathBuf>,
    /// Replace outputs that exist
    #[arg(long)]
    pub(super) force: bool,
}

#[derive(Debug, Args)]
pub(super) struct InitArguments {
    /// Data files: meshes, points and volumes
    #[arg(required = true, value_name = "FILE")]
    pub(super) inputs: Vec<PathBuf>,
    /// Scene file, .toml [default: the text goes to stdout, for a scene in this folder]
    #[arg(short, long = "output", value_name = "SCENE.toml")]
    pub(super) output: Option<PathBuf>,
    #[command(flatten)]
    pub(super) first: FirstArguments,
    /// Place the camera for a turntable of so many frames, which `organza render` draws: nothing is cut off in any of them
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(super) turntable: Option<u32>,
    /// Replace a scene that exists
    #[arg(long)]
    pub(super) force: bool,
    #[command(flatten)]
    pub(super) common: CommonArguments,
}

#[derive(Debug, Args)]
pub(super) struct ConvertArguments {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    /// Output, .ply
    #[arg(short, long = "output", value_name = "FILE.ply")]
    pub(super) output: PathBuf,
    /// Replace an output that exists
    #[arg(long)]
    pub(super) force: bool,
    /// Write some 16 bytes a splat in the place of 50, each number off by half a step of its block at most
    #[arg(long)]
    pub(super) packed: bool,
}

#[derive(Debug, Args)]
pub(super) struct ExtractArguments {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    /// Which light of the scene looks, counted from 0; of one with an extent its middle
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(super) light: usize,
    /// Absorbance up to the surface, above 0, at most 10: 0.69 takes half of the light
    #[arg(long, value_name = "A", default_value_t = 1.0)]
    pub(super) absorbance: f32,
    /// Output, .ply
    #[arg(short, long = "output", value_name = "FILE.ply")]
    pub(super) output: PathBuf,
    /// Replace an output that exists
    #[arg(long)]
    pub(super) force: bool,
}

#[derive(Debug, Args)]
pub(super) struct ExplainArguments {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    /// Render too, and say what each pass cost, and what each effect changes and takes: one picture more for each
    #[arg(long)]
    pub(super) measure: bool,
    /// Figures of this machine for predicted times, as `organza calibrate` wrote them [default: built-in figures]
    #[arg(long, value_name = "FILE")]
    pub(super) machine: Option<PathBuf>,
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
    /// A small picture, few repeats, sets, sheets and frames
    #[arg(long)]
    pub(super) quick: bool,
    /// Replace outputs that exist
    #[arg(long)]
    pub(super) force: bool,
}

#[derive(Debug, Args)]
pub(super) struct InfoArguments {
    /// Data file, or scene (.toml, .json)
    pub(super) file: PathBuf,
    /// Table of the labels of a volume, whose names stand beside their numbers; as for `render`
    #[arg(long, value_name = "FILE")]
    pub(super) labels: Option<PathBuf>,
    /// Refuse a data file with faults that could be mended
    #[arg(long)]
    pub(super) strict: bool,
    /// Allow data outside the scene's root folder
    #[arg(long, conflicts_with = "sandbox")]
    pub(super) allow_path: bool,
    /// Forbid data outside the scene's root folder even where the scene allows it by its key `root`: for scenes of strangers
    #[arg(long)]
    pub(super) sandbox: bool,
    /// Print one JSON document on stdout
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Debug, Args)]
pub(super) struct CalibrateArguments {
    /// File for the figures, JSON
    #[arg(short, long = "output", value_name = "FILE")]
    pub(super) output: PathBuf,
    /// Replace an output that exists
    #[arg(long)]
    pub(super) force: bool,
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

#[cfg(feature = "view")]
#[derive(Debug, Args)]
pub(super) struct ViewArguments {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    /// Address at which the page is served, with or without a port [default: 127.0.0.1, a free port]
    #[arg(long, value_name = "ADDRESS", value_parser = parse_address)]
    pub(super) listen: Option<SocketAddr>,
    /// Print the address of the page and do not open it in the browser
    #[arg(long)]
    pub(super) no_open: bool,
    /// Begin with the events of a file, as --record writes it
    #[arg(long, value_name = "EVENTS.json")]
    pub(super) play: Option<PathBuf>,
    /// Read the scene and its data again when they change
    #[arg(long)]
    pub(super) watch: bool,
    /// Write what is done on the page to a file, as it is done
    #[arg(long, value_name = "EVENTS.json")]
    pub(super) record: Option<PathBuf>,
    /// Replace a recording that exists
    #[arg(long, requires = "record")]
    pub(super) force: bool,
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

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_arguments_are_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn the_help_of_every_command_has_examples_of_it() {
        for command in Arguments::command().get_subcommands() {
            let name = command.get_name();
            let help = command.get_after_help().map(ToString::to_string);
            let example = format!("organza {name}");
            assert!(help.is_some_and(|help| help.contains(&example)), "{name}");
        }
    }
}
