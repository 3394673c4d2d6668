//! A recording on the device: its memory, its bindings and its runs.

use crate::device::{Device, Faults};
use splat_shaders::{BufferId, DeviceError, Dispatch, Groups, Inputs, PassTime, Recording, Run, Step, batches};
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

/// A buffer that the caller meets.
struct Met {
    id: BufferId,
    name: &'static str,
    bytes: u64,
}

/// A dispatch with its kernel and buffers bound.
struct Bound {
    dispatch: Dispatch,
    pipeline: wgpu::ComputePipeline,
    group: wgpu::BindGroup,
}

/// What is done in the order of the recording.
enum Action {
    Dispatch(Bound),
    /// Into this buffer, which the processor sees.
    Read(Met, wgpu::Buffer),
}

/// The device's clock: two notes for each dispatch.
struct Clock {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    seen: wgpu::Buffer,
}

/// A recording that is ready to run, as often as one likes.
pub struct Prepared {
    uploads: Vec<Met>,
    /// What was given last for each upload, in whole; zeros at first.
    given: Vec<Vec<u8>>,
    buffers: Vec<wgpu::Buffer>,
    actions: Vec<Action>,
    /// Actions that are submitted together, by what they took in the run before.
    batches: Vec<Range<usize>>,
    clock: Option<Clock>,
    device: wgpu::Device,
    queue: wgpu::Queue,
    faults: Arc<Faults>,
    patience: Duration,
    /// Whether the device did not come back from a run, and may still be at it.
    hung: bool,
}

impl Prepared {
    pub(crate) fn new(device: &mut Device, recording: &Recording, patience: Duration) -> Self {
        let (raw, queue, faults) = device.parts();
        let raw = raw.clone();
        let queue = queue.clone();
        let faults = faults.clone();
        use wgpu::BufferUsages as Usage;
        let device_usage = Usage::STORAGE | Usage::INDIRECT | Usage::COPY_SRC | Usage::COPY_DST;
        let buffers: Vec<_> = recording.buffers().iter().map(|b| buffer(&raw, b.name, b.bytes, device_usage)).collect();
        let met = |id: BufferId| {
            let recorded = &recording.buffers()[id.index()];
            Met { id, name: recorded.name, bytes: recorded.bytes }
        };
        let mut uploads = Vec::new();
        let mut given = Vec::new();
        let mut actions = Vec::new();
        for step in recording.steps() {
            match step {
                Step::Upload(id) => {
                    let met = met(*id);
                    given.push(vec![0; met.bytes as usize]);
                    uploads.push(met);
                }
                Step::Read(id) => {
                    let met = met(*id);
                    let seen = buffer(&raw, met.name, met.bytes, Usage::MAP_READ | Usage::COPY_DST);
                    actions.push(Action::Read(met, seen));
                }
                Step::Dispatch(dispatch) => {
                    let pipeline = device.pipeline(dispatch.kernel);
                    let group = bind(&raw, dispatch, &pipeline, &buffers);
                    actions.push(Action::Dispatch(Bound { dispatch: dispatch.clone(), pipeline, group }));
                }
            }
        }
        let dispatches = actions.iter().filter(|a| matches!(a, Action::Dispatch(_))).count() as u32;
        let clocked = dispatches > 0 && raw.features().contains(wgpu::Features::TIMESTAMP_QUERY);
        // Beyond this many queries, wgpu refuses a set.
        let clock =
            (clocked && 2 * dispatches <= wgpu::QUERY_SET_MAX_QUERIES).then(|| Clock::new(&raw, 2 * dispatches));
        let batches = batches(&vec![f64::INFINITY; actions.len()]);
        Self { uploads, given, buffers, actions, batches, clock, device: raw, queue, faults, patience, hung: false }
    }

    /// Uploads the inputs, runs the steps, waits, and gives what they read back. An input that is not given keeps its
    /// bytes of the run before, zeros at first; so does what lies beyond a shorter one. Uploads come before all else.
    ///
    /// # Errors
    /// [`DeviceError::Input`] for bytes that do not fit, [`DeviceError::Lost`] for a device that is lost or hangs,
    /// [`DeviceError::Driver`].
    pub fn run(&mut self, inputs: &Inputs<'_>) -> Result<Run, DeviceError> {
        if self.hung {
            return Err(DeviceError::Lost);
        }
        for (id, bytes) in inputs {
            for (met, given) in self.uploads.iter().zip(&mut self.given).filter(|(met, _)| met.id == *id) {
                let found = bytes.len() as u64;
                if found > met.bytes || !found.is_multiple_of(4) {
                    return Err(DeviceError::Input { name: met.name, found, had: met.bytes });
                }
                given[..bytes.len()].copy_from_slice(bytes);
            }
        }
        for (met, given) in self.uploads.iter().zip(&self.given) {
            self.queue.write_buffer(&self.buffers[met.id.index()], 0, given);
        }
        let mut query = 0;
        for batch in &self.batches {
            self.queue.submit([self.encode(&self.actions[batch.clone()], &mut query)]);
        }
        if let Some(clock) = &self.clock {
            self.queue.submit([clock.read(&self.device, query)]);
        }
        let reads = self.actions.iter().filter_map(|action| match action {
            Action::Read(met, seen) => Some((met.id, seen)),
            Action::Dispatch(_) => None,
        });
        let reads: Vec<_> = reads.collect();
        reads
            .iter()
            .map(|(_, seen)| *seen)
            .chain(self.clock.iter().map(|c| &c.seen))
            .for_each(|b| b.map_async(wgpu::MapMode::Read, .., |_| ()));
        let waited = self.device.poll(wgpu::PollType::Wait { submission_index: None, timeout: Some(self.patience) });
        self.faults.check("run", 0)?;
        if matches!(waited, Err(wgpu::PollError::Timeout)) {
            self.hung = true;
            // Who ends a device waits for it: this one is given up, and never ends.
            std::mem::forget((self.device.clone(), self.queue.clone()));
            return Err(DeviceError::Lost);
        }
        waited.map_err(|e| DeviceError::Driver { call: "poll", why: e.to_string() })?;
        let bytes = reads.iter().map(|(_, seen)| taken(seen)).collect::<Result<Vec<_>, _>>()?;
        let reads = reads.iter().map(|(id, _)| *id).zip(bytes).collect();
        Ok(Run { reads, passes: self.passes()? })
    }

    /// Commands of some actions, whose first query is `query`.
    fn encode(&self, actions: &[Action], query: &mut u32) -> wgpu::CommandBuffer {
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        for action in actions {
            match action {
                Action::Read(met, seen) => {
                    encoder.copy_buffer_to_buffer(&self.buffers[met.id.index()], 0, seen, 0, Some(met.bytes));
                }
                Action::Dispatch(bound) => {
                    let timestamp_writes = self.clock.as_ref().map(|clock| wgpu::ComputePassTimestampWrites {
                        query_set: &clock.queries,
                        beginning_of_pass_write_index: Some(*query),
                        end_of_pass_write_index: Some(*query + 1),
                    });
                    let label = Some(bound.dispatch.kernel.name);
                    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label, timestamp_writes });
                    self.dispatch(&mut pass, bound);
                    *query += 2;
                }
            }
        }
        encoder.finish()
    }

    fn dispatch(&self, pass: &mut wgpu::ComputePass<'_>, bound: &Bound) {
        pass.set_pipeline(&bound.pipeline);
        pass.set_bind_group(0, &bound.group, &[]);
        if !bound.dispatch.push.is_empty() {
            pass.set_immediates(0, &bound.dispatch.push);
        }
        match bound.dispatch.groups {
            Groups::Direct([x, y, z]) => pass.dispatch_workgroups(x, y, z),
            Groups::Indirect { buffer, offset } => {
                pass.dispatch_workgroups_indirect(&self.buffers[buffer.index()], offset);
            }
        }
    }

    /// Reads the clock, and plans the next run's submissions by it.
    fn passes(&mut self) -> Result<Vec<PassTime>, DeviceError> {
        let Some(clock) = &self.clock else { return Ok(Vec::new()) };
        let bytes = taken(&clock.seen)?;
        let (ticks, _) = bytes.as_chunks::<16>();
        let tick_ns = f64::from(self.queue.get_timestamp_period());
        let half = |pair: &[u8; 16], at: usize| u64::from_ne_bytes(std::array::from_fn(|k| pair[8 * at + k]));
        let time = |pair: &[u8; 16]| half(pair, 1).saturating_sub(half(pair, 0)) as f64 * tick_ns;
        let mut times = ticks.iter().map(time);
        let mut passes = Vec::new();
        let mut took = Vec::with_capacity(self.actions.len());
        for action in &self.actions {
            let nanoseconds = match action {
                Action::Dispatch(bound) => {
                    let nanoseconds = times.next().unwrap_or(f64::INFINITY);
                    passes.push(PassTime { kernel: bound.dispatch.kernel.name, nanoseconds });
                    nanoseconds
                }
                // wgpu has no clock for copies; they are short.
                Action::Read(..) => 0.0,
            };
            took.push(nanoseconds);
        }
        self.batches = batches(&took);
        Ok(passes)
    }
}

impl Clock {
    fn new(device: &wgpu::Device, count: u32) -> Self {
        use wgpu::BufferUsages as Usage;
        let descriptor = wgpu::QuerySetDescriptor { label: None, ty: wgpu::QueryType::Timestamp, count };
        let bytes = 8 * u64::from(count);
        Self {
            queries: device.create_query_set(&descriptor),
            resolved: buffer(device, "ticks", bytes, Usage::QUERY_RESOLVE | Usage::COPY_SRC),
            seen: buffer(device, "ticks seen", bytes, Usage::MAP_READ | Usage::COPY_DST),
        }
    }

    /// Brings the first `count` notes to where the processor sees them.
    fn read(&self, device: &wgpu::Device, count: u32) -> wgpu::CommandBuffer {
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.resolve_query_set(&self.queries, 0..count, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.seen, 0, Some(8 * u64::from(count)));
        encoder.finish()
    }
}

fn buffer(device: &wgpu::Device, name: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor { label: Some(name), size, usage, mapped_at_creation: false })
}

fn bind(
    device: &wgpu::Device,
    dispatch: &Dispatch,
    pipeline: &wgpu::ComputePipeline,
    buffers: &[wgpu::Buffer],
) -> wgpu::BindGroup {
    let entry = |(binding, id): (u32, &BufferId)| wgpu::BindGroupEntry {
        binding,
        resource: buffers[id.index()].as_entire_binding(),
    };
    let entries: Vec<_> = (0..).zip(&dispatch.buffers).map(entry).collect();
    let label = Some(dispatch.kernel.name);
    let layout = &pipeline.get_bind_group_layout(0);
    device.create_bind_group(&wgpu::BindGroupDescriptor { label, layout, entries: &entries })
}

/// The bytes of a buffer that was asked to be mapped and waited for.
fn taken(seen: &wgpu::Buffer) -> Result<Vec<u8>, DeviceError> {
    let view = seen.get_mapped_range(..);
    let bytes = view.map_err(|e| DeviceError::Driver { call: "map", why: e.to_string() })?.to_vec();
    seen.unmap();
    Ok(bytes)
}
