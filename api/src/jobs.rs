//! Periodic generation: the frames of a sky are made by the clock and kept, whether anybody asks or not.
//!
//! A job is the file `jobs/{name}.json` of the store, with a hash of itself; its frames are in the folder `jobs/{name}`.

mod claim;
mod cron;
mod folder;
mod handlers;
mod job;
pub mod record;
mod runner;
mod schedule;
mod spec;

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::SystemTime;

use serde_json::{Value, json};
use skyloom::image::sha256_hex;
use skyloom::scene::Scene;
use skyloom::store::{Store, StoreError};

use crate::app::App;
use crate::config::Config;
use crate::problem::{ApiError, FieldProblem};

pub use folder::{Found, FrameFolder};
pub use handlers::routes;
pub use job::{Counts, Job};
pub use spec::{Spec, Texture};

/// Folder of the store.
const FOLDER: &str = "jobs";
/// Ending of a job's file.
const ENDING: &str = ".json";

/// What there is of a name.
#[derive(Clone, Debug)]
enum Slot {
    /// A job.
    Works(Arc<Job>),
    /// What is stored of it cannot be used; why.
    Lost(String),
}

/// Files of jobs by the jobs' names: when each was written, and its length. What differs is read again.
type Seen = BTreeMap<String, (SystemTime, u64)>;

/// All jobs.
#[derive(Debug)]
pub struct Jobs {
    store: Arc<dyn Store>,
    /// Its lock orders whoever changes jobs.
    slots: Mutex<BTreeMap<String, Slot>>,
    /// As it was when it was looked last what other servers did.
    seen: Mutex<Seen>,
}

impl Jobs {
    /// Names of the jobs in a store.
    pub fn names(store: &dyn Store) -> Result<Vec<String>, StoreError> {
        let entries = store.list(FOLDER)?.into_iter();
        Ok(entries.filter_map(|entry| Some(entry.name.strip_suffix(ENDING)?.to_owned())).collect())
    }

    /// Opens what is stored, and takes in the jobs of the settings: those that the settings no longer have are dropped.
    pub fn open(store: Arc<dyn Store>, config: &Config) -> Result<Self, ApiError> {
        let jobs = Self { store, slots: Mutex::default(), seen: Mutex::default() };
        let mut set = BTreeMap::new();
        for (number, document) in config.jobs.list.iter().enumerate() {
            let at = format!("jobs.list[{number}]");
            let mut spec = spec::inline(document)
                .and_then(|scene| jobs.spec(document, &scene, config))
                .map_err(|error| named(&at, error))?;
            if document.get("name").is_none() {
                return Err(named(
                    &at,
                    ApiError::InvalidJob(vec![spec::problem("/name", "a job of the settings needs a name".to_owned())]),
                ));
            }
            spec.document["set"] = json!(true);
            if set.insert(spec.name.clone(), spec).is_some() {
                return Err(named(&at, ApiError::Conflict("there is another job of this name".to_owned())));
            }
        }
        for name in Self::names(&*jobs.store)? {
            let slot = jobs.stored(&name, config, &set)?;
            let Some(slot) = slot else { continue };
            jobs.lock().insert(name, slot);
        }
        for (name, spec) in set {
            if !matches!(jobs.lock().get(&name), Some(Slot::Works(_))) {
                let job = jobs.keep(spec)?;
                jobs.lock().insert(name, Slot::Works(job));
            }
        }
        Ok(jobs)
    }

    /// The job of a name as it is stored; none where the settings have another one in its place, or had it and no longer do.
    fn stored(&self, name: &str, config: &Config, set: &BTreeMap<String, Spec>) -> Result<Option<Slot>, ApiError> {
        let text = self.store.get(&key(name))?.unwrap_or_default();
        let Some(mut document) = whole(&text) else {
            tracing::warn!(name, "a stored job is damaged");
            return Ok(Some(Slot::Lost(format!(
                "what is stored of job {name} is damaged; send it again with POST /v1/jobs"
            ))));
        };
        let was_set = document.as_object_mut().and_then(|fields| fields.remove("set")).is_some();
        let read = spec::inline(&document).and_then(|scene| self.spec(&document, &scene, config));
        let spec = match read {
            Ok(spec) if spec.name == name => spec,
            other => {
                let error = other.err().map_or_else(|| "it has another name".to_owned(), |error| error.to_string());
                tracing::warn!(name, error, "a stored job is not accepted");
                return Ok(Some(Slot::Lost(format!(
                    "job {name} was given to another version or under other limits: {error}"
                ))));
            }
        };
        match set.get(name) {
            // Whether it rests is changed over HTTP.
            Some(wanted) if !same(&wanted.document, &spec.document) => Ok(None),
            None if was_set => {
                tracing::info!(name, "a job that the settings no longer have is dropped with its frames");
                let frames = self.folder(&spec)?;
                self.store.delete(&key(name))?;
                frames.clear()?;
                Ok(None)
            }
            _ => {
                let frames = self.folder(&spec)?;
                Ok(Some(Slot::Works(Arc::new(Job::new(spec, frames, was_set)))))
            }
        }
    }

    /// Takes in what other servers of the store were given, and lets go of what was changed or deleted there; gives the jobs that
    /// are to be set to work. Those of settings are each server's own.
    pub fn catch_up(&self, config: &Config) -> Result<Vec<Arc<Job>>, ApiError> {
        let mut slots = self.lock();
        let entries = self.store.list(FOLDER)?;
        let files = entries.into_iter().filter_map(|entry| {
            let name = entry.name.strip_suffix(ENDING)?.to_owned();
            Some((name, (entry.modified, entry.bytes)))
        });
        let files: Seen = files.collect();
        slots.retain(|name, slot| {
            let stays = files.contains_key(name) || matches!(slot, Slot::Works(job) if job.is_set);
            if let (false, Slot::Works(job)) = (stays, slot) {
                job.end();
                // What was written here before the deletion was known goes too.
                if let Err(error) = job.frames.clear() {
                    tracing::warn!(job = name, %error, "files of a deleted job stay");
                }
            }
            stays
        });
        let mut seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        let mut started = Vec::new();
        for name in files.iter().filter(|(name, file)| seen.get(*name) != Some(file)).map(|(name, _)| name) {
            let Some(document) = self.store.get(&key(name))?.as_deref().and_then(whole) else { continue };
            let known = slots.get(name);
            let is_known =
                |slot: &Slot| matches!(slot, Slot::Works(job) if job.is_set || job.spec.document == document);
            if known.is_some_and(is_known) || document.get("set").is_some() {
                continue;
            }
            let read = spec::inline(&document).and_then(|scene| self.spec(&document, &scene, config));
            let Some(spec) = read.ok().filter(|spec| spec.name == *name) else { continue };
            if let Some(Slot::Works(job)) = known {
                job.end();
                job.frames.close();
            }
            let frames = self.folder(&spec)?;
            let job = Arc::new(Job::new(spec, frames, false));
            slots.insert(name.clone(), Slot::Works(Arc::clone(&job)));
            started.push(job);
        }
        *seen = files;
        Ok(started)
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, Slot>> {
        self.slots.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn spec(&self, document: &Value, scene: &Arc<Scene>, config: &Config) -> Result<Spec, ApiError> {
        Spec::read(document, scene, &config.limits, &config.jobs).map_err(ApiError::InvalidJob)
    }

    fn folder(&self, spec: &Spec) -> Result<FrameFolder, StoreError> {
        let folder = format!("{FOLDER}/{}", spec.name);
        FrameFolder::open(Arc::clone(&self.store), folder, &spec.name, &spec.definition)
    }

    /// Writes a job down and opens its folder.
    fn keep(&self, mut spec: Spec) -> Result<Arc<Job>, StoreError> {
        let text = spec.document.to_string();
        let record = format!("{{\"sha256\":\"{}\",\"job\":{text}}}", sha256_hex(text.as_bytes()));
        self.store.put(&key(&spec.name), record.as_bytes())?;
        let is_set = spec.document.as_object_mut().and_then(|fields| fields.remove("set")).is_some();
        let frames = self.folder(&spec)?;
        Ok(Arc::new(Job::new(spec, frames, is_set)))
    }

    /// Takes a job in; false when exactly this one was there.
    pub fn insert(&self, spec: Spec, most: usize) -> Result<(Arc<Job>, bool), ApiError> {
        let mut slots = self.lock();
        match slots.get(&spec.name) {
            Some(Slot::Works(job)) if same(&job.spec.document, &spec.document) => return Ok((Arc::clone(job), false)),
            Some(Slot::Works(_)) => {
                return Err(ApiError::Conflict(format!(
                    "there is another job {}; delete it first, or give this one another name",
                    spec.name
                )));
            }
            None if slots.len() >= most => {
                return Err(ApiError::Conflict(format!("{} jobs are there; jobs.count allows {most}", slots.len())));
            }
            Some(Slot::Lost(_)) | None => {}
        }
        let name = spec.name.clone();
        let job = self.keep(spec)?;
        slots.insert(name, Slot::Works(Arc::clone(&job)));
        Ok((job, true))
    }

    /// Changes what of a job may be changed; its frames stay.
    pub fn change(&self, name: &str, changes: &Value, config: &Config) -> Result<Arc<Job>, ApiError> {
        const CHANGEABLE: [&str; 4] = ["paused", "keep", "ahead_s", "catch_up"];
        let Value::Object(changes) = changes else {
            let detail = format!("needed is an object with any of {}", CHANGEABLE.join(", "));
            return Err(ApiError::InvalidJob(vec![spec::problem("", detail)]));
        };
        let strange = changes.keys().filter(|field| !CHANGEABLE.contains(&field.as_str()));
        let detail = format!("it cannot be changed; {} can. Delete the job and give it again", CHANGEABLE.join(", "));
        let wrong: Vec<_> = strange.map(|field| spec::problem(&format!("/{field}"), detail.clone())).collect();
        if !wrong.is_empty() {
            return Err(ApiError::InvalidJob(wrong));
        }
        let mut slots = self.lock();
        let job = found(&slots, name)?;
        if job.is_set && changes.keys().any(|field| field != "paused") {
            return Err(ApiError::Conflict(format!("job {name} is in the settings file; it is changed there")));
        }
        let mut document = job.spec.document.clone();
        for (field, value) in changes {
            document[field] = value.clone();
        }
        let mut spec = self.spec(&document, &job.spec.scene, config)?;
        if job.is_set {
            spec.document["set"] = json!(true);
        }
        job.end();
        job.frames.close();
        let job = self.keep(spec)?;
        slots.insert(name.to_owned(), Slot::Works(Arc::clone(&job)));
        Ok(job)
    }

    /// Removes a job and its frames.
    pub fn remove(&self, name: &str) -> Result<(), ApiError> {
        let mut slots = self.lock();
        match slots.get(name) {
            None => return Err(unknown(name)),
            Some(Slot::Works(job)) if job.is_set => {
                return Err(ApiError::Conflict(format!("job {name} is in the settings file; take it out there")));
            }
            Some(Slot::Works(job)) => {
                job.end();
                self.store.delete(&key(name))?;
                job.frames.clear()?;
            }
            Some(Slot::Lost(_)) => {
                self.store.delete(&key(name))?;
                // No frame is of this definition, so all go.
                FrameFolder::open(Arc::clone(&self.store), format!("{FOLDER}/{name}"), name, "")?.clear()?;
            }
        }
        slots.remove(name);
        Ok(())
    }

    /// A job.
    pub fn get(&self, name: &str) -> Result<Arc<Job>, ApiError> {
        found(&self.lock(), name)
    }

    /// All jobs that work, by name.
    pub fn all(&self) -> Vec<Arc<Job>> {
        let slots = self.lock();
        slots
            .values()
            .filter_map(|slot| if let Slot::Works(job) = slot { Some(Arc::clone(job)) } else { None })
            .collect()
    }

    /// Names of those that are damaged, and why.
    pub fn lost(&self) -> Vec<(String, String)> {
        let slots = self.lock();
        let lost = |(name, slot): (&String, &Slot)| match slot {
            Slot::Lost(why) => Some((name.clone(), why.clone())),
            Slot::Works(_) => None,
        };
        slots.iter().filter_map(lost).collect()
    }

    /// Bytes of all frames.
    pub fn bytes(&self) -> u64 {
        self.all().iter().map(|job| job.frames.total().1).sum()
    }

    /// Sets all jobs to work.
    pub fn start(app: &Arc<App>) {
        for job in app.jobs.all() {
            tokio::spawn(runner::run(Arc::clone(app), job));
        }
        tokio::spawn(runner::follow(Arc::clone(app)));
    }
}

fn key(name: &str) -> String {
    format!("{FOLDER}/{name}{ENDING}")
}

fn unknown(name: &str) -> ApiError {
    ApiError::NoJob(format!("there is no job {}", name.chars().take(64).collect::<String>()))
}

fn found(slots: &BTreeMap<String, Slot>, name: &str) -> Result<Arc<Job>, ApiError> {
    match slots.get(name) {
        Some(Slot::Works(job)) => Ok(Arc::clone(job)),
        Some(Slot::Lost(why)) => Err(ApiError::NoJob(why.clone())),
        None => Err(unknown(name)),
    }
}

/// Whether two documents mean the same job, resting or not.
fn same(one: &Value, other: &Value) -> bool {
    let plain = |document: &Value| {
        let mut document = document.clone();
        if let Some(fields) = document.as_object_mut() {
            fields.retain(|name, _| !["paused", "set"].contains(&name.as_str()));
        }
        document
    };
    plain(one) == plain(other)
}

/// The document of a record whose hash is right.
pub fn whole(record: &[u8]) -> Option<Value> {
    let record: Value = serde_json::from_slice(record).ok()?;
    let document = record.get("job")?;
    (record.get("sha256")?.as_str()? == sha256_hex(document.to_string().as_bytes())).then(|| document.clone())
}

/// An error of the settings, with the place that is wrong.
fn named(at: &str, error: ApiError) -> ApiError {
    match error {
        ApiError::InvalidJob(errors) => {
            let place = |FieldProblem { pointer, detail }| spec::problem(&format!("{at}{pointer}"), detail);
            ApiError::InvalidJob(errors.into_iter().map(place).collect())
        }
        ApiError::Conflict(detail) => ApiError::Conflict(format!("{at}: {detail}")),
        other => other,
    }
}
