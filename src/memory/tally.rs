//! Adds up what stays and what goes.

/// What allocators keep of blocks that are empty again, at most: measured with a software driver, where it is a part of a block of a device.
const IDLE: u64 = 64 << 20;
/// Of all that is told, for what allocators lose between pieces: a sixteenth more.
const LOST: u64 = 16;

/// What is taken so far.
#[derive(Default)]
pub(super) struct Tally {
    kept: u64,
    peak: u64,
    /// What a device's allocator has got back and not yet given away.
    idle: u64,
    /// Of each stage what it keeps, and what it takes for itself at most.
    stages: Vec<(&'static str, u64, u64)>,
}

impl Tally {
    fn stage(&mut self, name: &'static str) -> &mut (&'static str, u64, u64) {
        let at = self.stages.iter().position(|(known, ..)| *known == name).unwrap_or_else(|| {
            self.stages.push((name, 0, 0));
            self.stages.len() - 1
        });
        &mut self.stages[at]
    }

    /// Bytes that stay until the texture is made.
    pub(super) fn keep(&mut self, stage: &'static str, bytes: u64) {
        self.kept += bytes;
        self.peak = self.peak.max(self.kept);
        self.stage(stage).1 += bytes;
    }

    /// Bytes that a stage takes on the device and for it beside what is kept by then, and gives back.
    pub(super) fn pass(&mut self, stage: &'static str, bytes: u64) {
        self.peak = self.peak.max(self.kept + bytes);
        self.idle = self.idle.max(bytes.min(IDLE));
        let passing = &mut self.stage(stage).2;
        *passing = bytes.max(*passing);
    }

    /// The same of what only the host takes.
    pub(super) fn pass_on_host(&mut self, stage: &'static str, bytes: u64) {
        self.peak = self.peak.max(self.kept + self.idle + bytes);
        let passing = &mut self.stage(stage).2;
        *passing = bytes.max(*passing);
    }

    /// Bytes at a time, at most.
    pub(super) fn peak(&self) -> u64 {
        self.peak + self.peak / LOST
    }

    /// The stage that takes most.
    pub(super) fn most(&self) -> &'static str {
        self.stages.iter().max_by_key(|(_, kept, passing)| kept + passing).map_or("texels", |(name, ..)| *name)
    }
}
