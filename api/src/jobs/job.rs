//! One job: what it is to do next, by the clock and by what is there.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde_json::{Value, json};
use tokio::sync::Notify;

use super::folder::FrameFolder;
use super::spec::Spec;
use crate::clock;

/// A resting job looks this often what of its frames is due, ms.
const REST_MS: i64 = 60_000;
/// Waits after failures, ms: twice as long each time.
const RETRY_MS: [i64; 2] = [1000, 60_000];
/// How often it is looked whether another server made a frame, ms.
const ELSEWHERE_MS: i64 = 1000;
/// Due times that are counted as missed at a time.
const MOST_MISSED: usize = 100_000;

/// A job at work.
#[derive(Debug)]
pub struct Job {
    /// What it is to do.
    pub spec: Spec,
    /// What it did.
    pub frames: FrameFolder,
    /// It comes from the settings file.
    pub is_set: bool,
    /// Woken when somebody changes it.
    pub changed: Notify,
    progress: Mutex<Progress>,
}

/// How far a job is.
#[derive(Debug, Default)]
struct Progress {
    is_gone: bool,
    making: Option<i64>,
    /// The due time that was the newest when it was looked last.
    current: Option<i64>,
    counts: Counts,
    last_error: Option<(i64, String)>,
    /// Failures since the last frame, and until when nothing is tried.
    failures: u32,
    retry_at: i64,
    /// Frames that were damaged and are to be made again.
    lost: BTreeSet<i64>,
    /// Frames that other servers make, and when it is looked again whether they did.
    elsewhere: BTreeMap<i64, i64>,
}

/// What was counted since the server started.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    /// Frames made.
    pub made: u64,
    /// Frames that were not there when the next one was due.
    pub missed: u64,
    /// Attempts that failed.
    pub failed: u64,
}

/// What a job does next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Makes the frame of a due time.
    Make(i64),
    /// Waits until a moment.
    Wait(i64),
}

impl Job {
    /// A job over its folder.
    pub fn new(spec: Spec, frames: FrameFolder, is_set: bool) -> Self {
        let is_due = |at: &i64| spec.schedule.at_or_before(*at) == Some(*at);
        let lost = frames.lost.iter().copied().filter(is_due).collect();
        let progress = Mutex::new(Progress { lost, ..Progress::default() });
        Self { spec, frames, is_set, changed: Notify::new(), progress }
    }

    fn lock(&self) -> MutexGuard<'_, Progress> {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether a moment belongs to the scene's time.
    fn has_time(&self, at_ms: i64) -> bool {
        self.spec.time_s(at_ms).is_some()
    }

    /// What is to be done now. The present frame comes first, then those to come, then damaged ones, then missed ones.
    pub fn next(&self, now_ms: i64) -> Step {
        let Spec { schedule, keep, ahead_ms, catch_up, .. } = &self.spec;
        if self.spec.paused {
            return Step::Wait(now_ms + REST_MS);
        }
        let mut progress = self.lock();
        let current = schedule.at_or_before(now_ms).filter(|at| self.has_time(*at));
        if current != progress.current {
            progress.counts.missed += self.missed(progress.current, current);
            progress.current = current;
        }
        let due = schedule.after(now_ms).unwrap_or(i64::MAX);
        let ahead = schedule.after(now_ms + ahead_ms).map_or(i64::MAX, |at| at - ahead_ms);
        let wake = due.min(ahead).min(now_ms + REST_MS).max(now_ms + 1);
        if progress.retry_at > now_ms {
            return Step::Wait(progress.retry_at.min(wake));
        }
        progress.lost.retain(|at| !self.frames.has(*at));
        if !progress.lost.is_empty() {
            let oldest = schedule.before(now_ms + 1, *keep).last().copied();
            progress.lost.retain(|at| oldest.is_some_and(|oldest| *at >= oldest));
        }
        let coming = schedule.between(now_ms, now_ms + ahead_ms, *keep + 1);
        let lost: Vec<i64> = progress.lost.iter().rev().copied().collect();
        let missed = current.map_or_else(Vec::new, |at| schedule.before(at, *catch_up));
        let wanted = current.into_iter().chain(coming).chain(lost).chain(missed);
        progress.elsewhere.retain(|_, until| *until > now_ms);
        let is_open = |at: &i64| self.has_time(*at) && !self.frames.has(*at) && !progress.elsewhere.contains_key(at);
        let next = wanted.into_iter().find(is_open);
        let wake = progress.elsewhere.values().min().map_or(wake, |until| wake.min(*until));
        progress.making = next;
        next.map_or(Step::Wait(wake), Step::Make)
    }

    /// Due times between two that have no frame, and the first itself.
    fn missed(&self, from: Option<i64>, to: Option<i64>) -> u64 {
        let (Some(from), Some(to)) = (from, to) else { return 0 };
        let between = self.spec.schedule.between(from, to - 1, MOST_MISSED);
        [from].into_iter().chain(between).filter(|at| !self.frames.has(*at)).count() as u64
    }

    /// A frame was made.
    pub fn made(&self) {
        let mut progress = self.lock();
        progress.making = None;
        progress.counts.made += 1;
        (progress.failures, progress.retry_at, progress.last_error) = (0, 0, None);
    }

    /// Another server makes a frame.
    pub fn leave(&self, at_ms: i64, now_ms: i64) {
        self.lock().elsewhere.insert(at_ms, now_ms + ELSEWHERE_MS);
    }

    /// A frame could not be made; gives the moment from which it is tried again.
    pub fn failed(&self, now_ms: i64, why: String) -> i64 {
        let mut progress = self.lock();
        let wait = RETRY_MS[0].saturating_mul(1 << progress.failures.min(10)).min(RETRY_MS[1]);
        progress.making = None;
        progress.counts.failed += 1;
        progress.failures += 1;
        progress.retry_at = now_ms + wait;
        progress.last_error = Some((now_ms, why));
        progress.retry_at
    }

    /// A frame was damaged: it is made again.
    pub fn lose(&self, at_ms: i64) {
        self.lock().lost.insert(at_ms);
        self.changed.notify_one();
    }

    /// It was deleted or replaced: it ends.
    pub fn end(&self) {
        self.lock().is_gone = true;
        self.changed.notify_one();
    }

    /// Whether it is to end.
    pub fn is_gone(&self) -> bool {
        self.lock().is_gone
    }

    /// What was counted.
    pub fn counts(&self) -> Counts {
        self.lock().counts
    }

    /// In a word: `paused`, `failing`, `running`.
    pub fn state(&self) -> &'static str {
        if self.spec.paused {
            "paused"
        } else if self.lock().last_error.is_some() {
            "failing"
        } else {
            "running"
        }
    }

    /// What callers are told.
    pub fn describe(&self, now_ms: i64) -> Value {
        let moment = |at: Option<i64>| at.map(clock::rfc3339);
        let state = self.state();
        let progress = self.lock();
        let (kept, bytes) = self.frames.total();
        let Counts { made, missed, failed } = progress.counts;
        let next = self.spec.schedule.after(now_ms).filter(|at| !self.spec.paused && self.has_time(*at));
        let own = format!("/v1/jobs/{}", self.spec.name);
        let mut told = self.spec.document.clone();
        let scene = told.as_object_mut().and_then(|told| told.remove("scene"));
        told["sky"] = json!(self.spec.sky);
        told["id"] = json!(self.spec.name);
        told["from"] = json!(if self.is_set { "settings" } else { "request" });
        told["state"] = json!(state);
        told["frames"] = json!({ "kept": kept, "bytes": bytes, "made": made, "missed": missed, "failed": failed });
        told["latest"] = json!(moment(self.frames.latest(now_ms)));
        told["next"] = json!(moment(next));
        told["making"] = json!(moment(progress.making));
        told["last_error"] = match &progress.last_error {
            Some((at, detail)) => json!({ "at": clock::rfc3339(*at), "detail": detail }),
            None => Value::Null,
        };
        told["links"] =
            json!({ "self": own, "latest": format!("{own}/latest.json"), "manifest": format!("{own}/manifest.json") });
        told["scene"] = scene.unwrap_or_default();
        told
    }
}
