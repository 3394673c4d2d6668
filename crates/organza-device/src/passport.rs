//! `organza passport`: every recording on every device by every backend, against its twin on the processor.

mod chain;
mod composite;
mod opaque;
mod particles;
mod shadow;

use crate::choice::{backends, listed};
use crate::trial::OrderInput;
use crate::{Error, Failure, Folding};
use chain::ChainInput;
use composite::CompositeInput;
use hbsort::gpu::SliceRun;
use opaque::OpaqueInput;
use particles::ParticlesInput;
use shadow::ShadowInput;
use splat_core::SliceOrder;
use splat_shaders::{Adapter, Backend, Choice, DeviceError, Executor, Lanes, PassTime, Validation};

/// Splats that are ordered.
const SPLATS: u32 = 1 << 17;
/// Pictures of particles and of splats.
const SIZE: [u32; 2] = [320, 200];
/// Share of pixels whose hits must agree, for a GPU may round the square root and the division in k otherwise; and of splats
/// whose light through maps that stay must.
const LEAST_SHARE: f64 = 0.999;

/// One device by one backend.
#[derive(Debug, Clone, PartialEq)]
pub struct Passport {
    /// The backend: `ash` or `wgpu`.
    pub backend: &'static str,
    /// The device. Of a software driver the timings are the processor's.
    pub adapter: Adapter,
    /// Missing features, one phrase each.
    pub missing: Vec<&'static str>,
    /// Every recording.
    pub recordings: Vec<Checked>,
}

impl Passport {
    /// Whether every recording ran and agrees with its twin.
    pub fn valid(&self) -> bool {
        self.recordings.iter().all(|r| r.outcome.as_ref().is_ok_and(|a| a.within))
    }
}

/// One recording on one device.
#[derive(Debug, Clone, PartialEq)]
pub struct Checked {
    /// `order`, `shadow lists`, `shadow` (deposits, lists and look-ups as one), `project`, `shade`, `composite`, `opaque`,
    /// `chain` (the order, `project`, `shade` and `composite` as one), `particles` (uploaded sets), `made particles` (sets of the
    /// same seeds that the device makes) or `lit particles` (the same in the light of a lamp with a shadow map).
    pub recording: &'static str,
    /// Splats or particles that went in.
    pub items: u64,
    /// How it agrees with the processor, or why it did not run.
    pub outcome: Result<Agreement, String>,
    /// Its kernels with their times on the device; empty where it has no clock.
    pub passes: Vec<KernelTime>,
}

/// Comparison of a device's results with the processor's.
#[derive(Debug, Clone, PartialEq)]
pub struct Agreement {
    /// Whether that is enough: equal bits for the order and the lists of shadow maps, 10⁻⁵ for what
    /// is made of splats, 10⁻⁴ for 99.9 % of the splats lit through maps that stay on the device, 10⁻⁵ for 99.9 % of the
    /// pixels of opaque splats, 99.9 % of the pixels' hits for particles, and where they agree 3·10⁻⁵ of the brightest light, but
    /// for 0.1 % of the pixels.
    pub within: bool,
    /// Share of places, cells or pixels that are equal in bits.
    pub equal_share: f64,
    /// Mean difference, in the unit.
    pub mean: f64,
    /// Largest difference, in the unit.
    pub max: f64,
    /// The quantity of the differences: `places`, `absorbance`, `transmittance`, `radiance` or `of itself`.
    pub unit: &'static str,
}

/// A kernel's dispatches of one run together.
#[derive(Debug, Clone, PartialEq)]
pub struct KernelTime {
    /// The kernel.
    pub kernel: &'static str,
    /// How often it was started.
    pub dispatches: u32,
    /// Their time, nanoseconds.
    pub nanoseconds: f64,
}

/// Runs every recording on generated input on every device whose name contains `name`, software drivers included.
///
/// # Errors
/// When a driver fails to say what there is.
pub fn passport(name: &str) -> Result<Vec<Passport>, Error> {
    let input = Inputs {
        order: OrderInput::new(SPLATS),
        shadow: ShadowInput::new(),
        composite: CompositeInput::new(),
        opaque: OpaqueInput::new(),
        chain: ChainInput::new(),
        particles: ParticlesInput::new(),
    };
    let mut passports = Vec::new();
    for backend in backends() {
        for (place, adapter) in listed(&*backend)?.into_iter().enumerate().filter(|(_, a)| a.name.contains(name)) {
            passports.push(inspect(&*backend, place, adapter, &input));
        }
    }
    Ok(passports)
}

/// Inputs of the recordings, the same for all devices.
struct Inputs {
    order: OrderInput,
    shadow: ShadowInput,
    composite: CompositeInput,
    opaque: OpaqueInput,
    chain: ChainInput,
    particles: ParticlesInput,
}

fn inspect(backend: &dyn Backend, place: usize, adapter: Adapter, input: &Inputs) -> Passport {
    let mut device = backend.open(&Choice::Place(place), Validation::Off);
    if let Ok(other) = device.as_ref().map(|d| d.adapter().name.clone())
        && other != adapter.name
    {
        device = Err(DeviceError::NoDevice { why: format!("{other} took its place") });
    }
    let mut check = |recording, work: &mut dyn FnMut(&mut dyn Executor) -> Result<Found, Failure>| {
        let found = device.as_mut().map_err(|e| Failure::from(e.clone())).and_then(|device| {
            // The first run pays for what drivers put off.
            work(&mut **device)?;
            work(&mut **device)
        });
        match found {
            Ok(Found { items, agreement, passes }) => {
                Checked { recording, items, outcome: Ok(agreement), passes: by_kernel(&passes) }
            }
            Err(why) => Checked { recording, items: 0, outcome: Err(why.to_string()), passes: Vec::new() },
        }
    };
    let recordings = vec![
        check("order", &mut |device| check_order(device, &input.order)),
        check("shadow lists", &mut |device| input.shadow.check_lists(device)),
        check("shadow", &mut |device| input.shadow.check_shadow(device)),
        check("project", &mut |device| input.chain.check_project(device)),
        check("shade", &mut |device| input.chain.check_shade(device)),
        check("composite", &mut |device| input.composite.check(device)),
        check("opaque", &mut |device| input.opaque.check(device)),
        check("chain", &mut |device| input.chain.check_chain(device)),
        check("particles", &mut |device| input.particles.check(device, Folding::uploaded())),
        check("made particles", &mut |device| input.particles.check(device, Folding::default())),
        check("lit particles", &mut |device| input.particles.check_lit(device, &input.shadow)),
    ];
    let clockless = recordings.iter().all(|r| r.outcome.is_ok() && r.passes.is_empty());
    let missing = [
        (clockless, "timestamps"),
        (adapter.subgroup == 0, "the size of a subgroup"),
        (Lanes::for_adapter(&adapter) == Lanes::Portable, "operations of subgroups"),
    ];
    let missing = missing.into_iter().filter(|(lacks, _)| *lacks).map(|(_, what)| what).collect();
    Passport { backend: backend.name(), adapter, missing, recordings }
}

/// Results of a recording.
struct Found {
    items: u64,
    agreement: Agreement,
    passes: Vec<PassTime>,
}

fn by_kernel(passes: &[PassTime]) -> Vec<KernelTime> {
    let mut kernels: Vec<KernelTime> = Vec::new();
    for PassTime { kernel, nanoseconds } in passes {
        match kernels.iter_mut().find(|k| k.kernel == *kernel) {
            Some(known) => {
                known.dispatches += 1;
                known.nanoseconds += nanoseconds;
            }
            None => kernels.push(KernelTime { kernel, dispatches: 1, nanoseconds: *nanoseconds }),
        }
    }
    kernels
}

fn check_order(device: &mut dyn Executor, input: &OrderInput) -> Result<Found, Failure> {
    let SliceRun { order: found, passes } = input.on(device)?;
    let agreement = order_agreement(&found, &input.by_processor()?);
    Ok(Found { items: SPLATS.into(), agreement, passes })
}

/// How far splats are from their places; one that a side culled alone is as far away as there are places.
fn order_agreement(found: &SliceOrder, expected: &SliceOrder) -> Agreement {
    let places = |order: &SliceOrder| {
        let mut place = vec![None; SPLATS as usize];
        (0u32..).zip(&order.input_from_sorted).for_each(|(at, &id)| place[id as usize] = Some(at));
        place
    };
    let distance = |pair: (Option<u32>, Option<u32>)| match pair {
        (Some(a), Some(b)) => f64::from(a.abs_diff(b)),
        (None, None) => 0.0,
        _ => f64::from(SPLATS),
    };
    let apart: Vec<f64> = places(found).into_iter().zip(places(expected)).map(distance).collect();
    let n = apart.len() as f64;
    Agreement {
        within: found == expected,
        equal_share: apart.iter().filter(|d| **d == 0.0).count() as f64 / n,
        mean: apart.iter().sum::<f64>() / n,
        max: apart.iter().copied().fold(0.0, f64::max),
        unit: "places",
    }
}
