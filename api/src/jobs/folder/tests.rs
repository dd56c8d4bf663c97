//! Frames in a folder of a disk: what damages, another definition, the clock and a store that fails do to them.

use skyloom::store::Folder;

use super::*;

const AT: i64 = clock::DEFAULT_START_MS;

fn open(path: &std::path::Path, definition: &str) -> FrameFolder {
    FrameFolder::open(Arc::new(Folder::new(path)), "jobs/roof".to_owned(), "roof", definition).unwrap()
}

fn fill(folder: &FrameFolder) {
    for number in 0..4 {
        let bytes = Content::Memory(vec![u8::try_from(number).unwrap(); 9].into());
        let files = [("cloud.exr".to_owned(), bytes.clone()), ("sky.png".to_owned(), bytes)];
        folder.keep(AT + number * 1000, number as f64, "d", &files).unwrap();
    }
}

#[test]
fn every_file_that_is_damaged_or_gone_is_noticed_and_its_frame_alone_is_dropped() {
    for name in ["20260101t000001z.json", "20260101t000001z-cloud.exr", "20260101t000001z-sky.png"] {
        for gone in [false, true] {
            let data = tempfile::tempdir().unwrap();
            fill(&open(data.path(), "d"));
            let path = data.path().join("jobs/roof").join(name);
            if gone {
                std::fs::remove_file(&path).unwrap();
            } else {
                std::fs::write(&path, b"{\"time\": 1").unwrap();
            }
            let folder = open(data.path(), "d");
            // Damage that shows without reading every file, and no record that is gone: that is a frame that was dropped.
            let is_seen = if name.ends_with(".json") { !gone } else { gone };
            assert_eq!(folder.lost, if is_seen { vec![AT + 1000] } else { Vec::new() }, "{name} {gone}");
            assert!(!folder.is_whole(AT + 1000).unwrap() && !folder.has(AT + 1000), "{name} {gone}");
            assert!([0, 2, 3].iter().all(|number| folder.is_whole(AT + number * 1000).unwrap()), "{name} {gone}");
            let left = std::fs::read_dir(data.path().join("jobs/roof")).unwrap();
            assert_eq!(left.count(), 9, "nothing of it is left");
        }
    }
}

#[test]
fn what_is_of_another_definition_goes_and_what_is_not_ours_stays() {
    let data = tempfile::tempdir().unwrap();
    fill(&open(data.path(), "d"));
    let own = data.path().join("jobs/roof/notes.txt");
    std::fs::write(&own, b"kept").unwrap();
    let folder = open(data.path(), "other");
    assert_eq!(folder.total(), (0, 0));
    assert_eq!(std::fs::read_dir(data.path().join("jobs/roof")).unwrap().count(), 1);
    assert!(own.is_file());
}

#[test]
fn documents_follow_the_clock_and_old_frames_go() {
    let data = tempfile::tempdir().unwrap();
    let folder = open(data.path(), "d");
    fill(&folder);
    let read = |name: &str| std::fs::read_to_string(data.path().join("jobs/roof").join(name)).ok();
    folder.publish(AT - 1).unwrap();
    assert_eq!(read("latest.json"), None, "nothing is due");
    folder.trim(1, AT + 1500).unwrap();
    folder.publish(AT + 1500).unwrap();
    let latest: Value = serde_json::from_str(&read("latest.json").unwrap()).unwrap();
    assert_eq!((&latest["at"], &latest["time"]), (&json!("2026-01-01T00:00:01Z"), &json!(1.0)));
    let manifest: Value = serde_json::from_str(&read("manifest.json").unwrap()).unwrap();
    let times: Vec<_> = manifest["frames"].as_array().unwrap().iter().map(|frame| frame["time"].clone()).collect();
    assert_eq!(times, [1.0, 2.0, 3.0], "one that was due, and those to come");
    assert!(folder.total() == (3, 54) && folder.read(AT, "sky.png", &mut io::sink()).unwrap() == Found::Unknown);
}

/// A store whose room ends with some of the keys.
#[derive(Debug)]
struct Full(Folder, Mutex<Option<&'static str>>);

impl Full {
    fn has_room(&self, key: &str) -> Result<(), StoreError> {
        match *lock(&self.1) {
            Some(end) if key.ends_with(end) => Err(StoreError::Full(key.to_owned())),
            _ => Ok(()),
        }
    }
}

impl Store for Full {
    fn get(&self, key: &str) -> Result<Option<Vec<u8>>, StoreError> {
        self.0.get(key)
    }
    fn put(&self, key: &str, bytes: &[u8]) -> Result<(), StoreError> {
        self.has_room(key).and_then(|()| self.0.put(key, bytes))
    }
    fn create(&self, key: &str, bytes: &[u8]) -> Result<bool, StoreError> {
        self.0.create(key, bytes)
    }
    fn delete(&self, key: &str) -> Result<bool, StoreError> {
        self.0.delete(key)
    }
    fn list(&self, folder: &str) -> Result<Vec<Entry>, StoreError> {
        self.0.list(folder)
    }
    fn exists(&self, key: &str) -> Result<bool, StoreError> {
        self.0.exists(key)
    }
    fn used(&self, key: &str) {
        self.0.used(key);
    }
}

#[test]
fn where_there_is_no_room_for_a_whole_frame_nothing_of_it_stays() {
    let data = tempfile::tempdir().unwrap();
    let store = Arc::new(Full(Folder::new(data.path()), Mutex::default()));
    let folder = FrameFolder::open(Arc::<Full>::clone(&store), "jobs/roof".to_owned(), "roof", "d").unwrap();
    fill(&folder);
    let before = folder.manifest();
    let bytes = Content::Memory(vec![5; 9].into());
    let files = [("cloud.exr".to_owned(), bytes.clone()), ("sky.png".to_owned(), bytes)];
    let keep = || folder.keep(AT + 4000, 4.0, "d", &files);
    for end in ["-cloud.exr", "-sky.png", ".json"] {
        *lock(&store.1) = Some(end);
        assert!(matches!(keep(), Err(StoreError::Full(key)) if key.ends_with(end)));
        assert!(!folder.has(AT + 4000) && folder.manifest() == before, "{end}");
        assert_eq!(store.list("jobs/roof").unwrap().len(), 12, "{end}");
    }
    *lock(&store.1) = None;
    keep().unwrap();
    assert!(folder.is_whole(AT + 4000).unwrap());
    folder.clear().unwrap();
    assert_eq!((folder.total(), store.list("jobs/roof").unwrap()), ((0, 0), Vec::new()));
}
