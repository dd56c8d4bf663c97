//! What may go: what was not used for long, what is beyond its quota, and what killed writers left.

use std::collections::HashSet;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use skyloom::store::{Entry, Store, StoreError, Upkeep, is_leftover};

use crate::app::{App, blocking};
use crate::bounded::surplus;
use crate::config::Config;
use crate::files::is_hex;
use crate::{finished, notices};

/// How often a server removes what may go.
const EVERY: Duration = Duration::from_secs(3600);
/// Notices of deletion are seen within seconds.
const NOTICES: Duration = Duration::from_secs(3600);
const DAY: Duration = Duration::from_secs(86_400);

/// Something that may go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Removal {
    /// Its path in the store.
    pub path: String,
    /// Its length.
    pub bytes: u64,
    /// Why it may go.
    pub why: String,
}

impl Removal {
    fn new(folder: &str, entry: &Entry, why: impl Into<String>) -> Self {
        Self { path: format!("{folder}/{}", entry.name), bytes: entry.bytes, why: why.into() }
    }
}

/// What may go by the settings. A sky is never made to give way to others: whoever registered it was given its address for good,
/// unless the settings say for how long.
pub fn outdated(store: &dyn Store, config: &Config, now: SystemTime) -> Result<Vec<Removal>, StoreError> {
    let rules = &config.store;
    let mut removals = Vec::new();
    let is_over =
        |entry: &Entry, days: u64| days > 0 && entry.age(now) >= DAY * u32::try_from(days).unwrap_or(u32::MAX);
    for entry in store.list("skies")? {
        let is_sky = entry.name.strip_suffix(".json").is_some_and(|id| is_hex(id, 32));
        if is_sky && is_over(&entry, rules.sky_days) {
            removals.push(Removal::new("skies", &entry, format!("not used for {} days", rules.sky_days)));
        }
    }
    if rules.image_days > 0 {
        let gone: HashSet<&str> = removals.iter().map(|removal| removal.path.as_str()).collect();
        let named = named_images(store, &gone)?;
        // Listed after the scenes were read: what was used meanwhile shows.
        for entry in store.list("images")? {
            let is_image = is_hex(&entry.name, 64) && !named.contains(&entry.name);
            if is_image && is_over(&entry, rules.image_days) {
                let why = format!("named by no sky and no job, and not used for {} days", rules.image_days);
                removals.push(Removal::new("images", &entry, why));
            }
        }
    }
    for (folder, most) in [("tables", rules.table_bytes), (finished::FOLDER, rules.texture_bytes)] {
        let beyond = surplus(store.list(folder)?, 0, most);
        let why = format!("beyond the {most} bytes of {folder}, and not used for longest");
        removals.extend(beyond.iter().map(|entry| Removal::new(folder, entry, why.clone())));
    }
    let notices = store.list(notices::FOLDER)?;
    let old = notices.iter().filter(|entry| entry.age(now) > NOTICES);
    removals.extend(old.map(|entry| Removal::new(notices::FOLDER, entry, "a notice that everybody has seen")));
    Ok(removals)
}

/// The images that registered skies and jobs name, whatever else their files say: also a damaged one may be mended.
fn named_images(store: &dyn Store, except: &HashSet<&str>) -> Result<HashSet<String>, StoreError> {
    let mut named = HashSet::new();
    for folder in ["skies", "jobs"] {
        for entry in store.list(folder)? {
            let key = format!("{folder}/{}", entry.name);
            if except.contains(key.as_str()) {
                continue;
            }
            let text = store.get(&key)?.unwrap_or_default();
            let words =
                text.split(|byte| !byte.is_ascii_alphanumeric()).filter_map(|word| std::str::from_utf8(word).ok());
            named.extend(words.filter(|word| is_hex(word, 64)).map(str::to_owned));
        }
    }
    Ok(named)
}

/// A registered sky or a job that names an image, by its key in the store.
pub fn named_by(store: &dyn Store, image: &str) -> Result<Option<String>, StoreError> {
    if !is_hex(image, 64) {
        return Ok(None);
    }
    for folder in ["skies", "jobs"] {
        for entry in store.list(folder)? {
            let key = format!("{folder}/{}", entry.name);
            let text = store.get(&key)?.unwrap_or_default();
            if text.windows(image.len()).any(|part| part == image.as_bytes()) {
                return Ok(Some(key));
            }
        }
    }
    Ok(None)
}

/// What killed writers left, and frames of jobs that are no more.
pub fn leftovers(store: &dyn Upkeep, now: SystemTime) -> Result<Vec<Removal>, StoreError> {
    let all = store.survey()?;
    let names: HashSet<&str> = all.iter().map(|entry| entry.name.as_str()).collect();
    let why = |entry: &Entry| {
        let (folder, name) = entry.name.rsplit_once('/').unwrap_or(("", &entry.name));
        let job = folder.strip_prefix("jobs/").map(|job| format!("jobs/{job}.json"));
        if is_leftover(name, entry.modified, now) {
            Some("left by a writer that was killed")
        } else if job.is_some_and(|job| !names.contains(job.as_str())) && entry.age(now) > NOTICES {
            Some("of a job that is no more")
        } else {
            None
        }
    };
    let removal =
        |entry: &Entry| Some(Removal { path: entry.name.clone(), bytes: entry.bytes, why: why(entry)?.to_owned() });
    Ok(all.iter().filter_map(removal).collect())
}

/// Removes what may go by the settings; false when it was gone.
pub fn remove(store: &dyn Store, removal: &Removal) -> Result<bool, StoreError> {
    if let Some(id) = removal.path.strip_prefix("skies/").and_then(|name| name.strip_suffix(".json")) {
        notices::tell(store, id)?;
    }
    store.delete(&removal.path)
}

/// Removes what may go, again and again while the server runs.
pub async fn sweep(app: Arc<App>) {
    loop {
        let own = Arc::clone(&app);
        let done = blocking(move || {
            let store = &*own.store;
            for removal in outdated(store, &own.config, SystemTime::now())? {
                if remove(store, &removal)? {
                    tracing::info!(path = removal.path, bytes = removal.bytes, why = removal.why, "removed");
                }
            }
            Ok(())
        });
        if let Err(error) = done.await {
            tracing::warn!(%error, "what may go could not be removed");
        }
        tokio::time::sleep(EVERY).await;
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use skyloom::store::Folder;

    use super::*;

    #[test]
    fn skies_go_by_their_last_use_alone_and_images_when_nobody_names_them() {
        let data = tempfile::tempdir().unwrap();
        let store = Folder::new(data.path());
        let (image, other, young) = ("a".repeat(64), "b".repeat(64), "c".repeat(64));
        let sky = |digit: &str| format!("skies/{}.json", digit.repeat(32));
        store.put(&sky("1"), format!("{{\"image\":\"{image}\"}}").as_bytes()).unwrap();
        store.put(&sky("2"), format!("{{\"image\":\"{other}\"}}").as_bytes()).unwrap();
        store.put("skies/README", b"own").unwrap_err();
        store.put("skies/notes", b"own").unwrap();
        for name in [&image, &other, &young] {
            store.put(&format!("images/{name}"), b"x").unwrap();
        }
        let now = SystemTime::now();
        let age = |key: &str, days: u32| {
            let file = std::fs::File::options().write(true).open(data.path().join(key)).unwrap();
            file.set_modified(now - DAY * days).unwrap();
        };
        for (key, days) in [
            (sky("1"), 8),
            (sky("2"), 29),
            ("skies/notes".to_owned(), 99),
            (format!("images/{image}"), 99),
            (format!("images/{other}"), 99),
            (format!("images/{young}"), 2),
        ] {
            age(&key, days);
        }
        let paths = |sky_days, image_days| {
            let mut config = Config::default();
            (config.store.sky_days, config.store.image_days) = (sky_days, image_days);
            let mut paths: Vec<_> =
                outdated(&store, &config, now).unwrap().into_iter().map(|removal| removal.path).collect();
            paths.sort();
            paths
        };
        assert_eq!(paths(0, 0), Vec::<String>::new());
        assert_eq!(paths(0, 7), Vec::<String>::new(), "both old images are named");
        assert_eq!(paths(28, 0), [sky("2")]);
        assert_eq!(paths(28, 7), [format!("images/{other}"), sky("2")], "its sky goes, and so does the image");
        assert_eq!(
            paths(7, 1),
            [format!("images/{image}"), format!("images/{other}"), format!("images/{young}"), sky("1"), sky("2")]
        );
    }
}
