//! What a render cost: one entry a stage, in the order of running.

/// The cost of one stage.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StageCost {
    /// Name of the stage, such as `tsm build`.
    pub name: String,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// Items that went in.
    pub items_in: u64,
    /// Items that came out.
    pub items_out: u64,
    /// Footprint fragments evaluated.
    pub fragments: u64,
    /// Bytes of the buffers that the stage made.
    pub bytes: u64,
    /// How often the stage ran.
    pub passes: u64,
}

/// The cost of a render.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CostRecord {
    /// Stages in the order of running. A stage that did not run has no entry.
    pub stages: Vec<StageCost>,
}

impl CostRecord {
    /// Runs `work`, which fills in the counts, and records its time under `name`.
    ///
    /// # Errors
    /// Those of `work`; a failed stage leaves no entry.
    pub fn measure<T, E>(&mut self, name: &str, work: impl FnOnce(&mut StageCost) -> Result<T, E>) -> Result<T, E> {
        let mut stage = StageCost { name: name.into(), passes: 1, ..StageCost::default() };
        let start = std::time::Instant::now();
        let out = work(&mut stage)?;
        stage.seconds = start.elapsed().as_secs_f64();
        self.stages.push(stage);
        Ok(out)
    }

    /// Makes one entry of all that a stage has left, as if it had run once: times and counts add, buffers are the largest.
    pub fn join(&mut self, name: &str) {
        let (of_stage, others): (Vec<_>, Vec<_>) = self.stages.drain(..).partition(|stage| stage.name == name);
        self.stages = others;
        self.stages.extend(of_stage.into_iter().reduce(|mut sum, stage| {
            sum.seconds += stage.seconds;
            sum.items_in += stage.items_in;
            sum.items_out += stage.items_out;
            sum.fragments += stage.fragments;
            sum.passes += stage.passes;
            sum.bytes = sum.bytes.max(stage.bytes);
            sum
        }));
    }
}
