//! A store in a bucket of a service that speaks S3's protocol, by the crate `object_store`.
//!
//! What a bucket promises is what [`Store`] asks for: an object is there whole or not at all, and durable once its writing was
//! acknowledged; a listing shows what was acknowledged before; and a conditional write (`If-None-Match: *`) succeeds once. It has no
//! cheap way to note that an object is in use: what was written first counts as that which was not used for longest.

use std::future::Future;
use std::io::{self, Cursor, Read};
use std::ops::Range;
use std::sync::{Arc, mpsc};
use std::time::Duration;

use futures_util::TryStreamExt as _;
use object_store::aws::{AmazonS3, AmazonS3Builder};
use object_store::path::Path;
use object_store::{
    ClientOptions, Error, GetOptions, GetRange, MultipartUpload, ObjectMeta, ObjectStore as _, ObjectStoreExt as _,
    PutMode, PutOptions, PutPayload, RetryConfig,
};
use skyloom::store::{Blob, Entry, Store, StoreError, Upkeep, is_part};
use tokio::runtime::{Builder, Handle, Runtime};

/// Time for a connection, and for one request: tables of hundreds of megabytes go in one.
const CONNECT: Duration = Duration::from_secs(3);
const REQUEST: Duration = Duration::from_secs(120);
/// A request is tried so often more, and no longer than this after its first try: whoever waits is told then.
const RETRIES: usize = 3;
const RETRY: Duration = Duration::from_secs(10);
/// What is larger goes to and from a service in pieces of this: parts of an object have 5 MiB at least, and 10,000 is the most of them.
const PIECE: u64 = 8 << 20;
/// Where damaged objects go.
const ASIDE: &str = "aside";

/// A store in a bucket.
#[derive(Debug)]
pub struct Bucket {
    client: Arc<AmazonS3>,
    /// Before every key, with a slash at its end; empty for the whole bucket.
    prefix: String,
    /// Where requests run, so that a store can be used from any thread.
    runtime: Option<Runtime>,
}

impl Bucket {
    /// The store in a bucket below a prefix. Endpoint, region and credentials are those of the environment: `AWS_ENDPOINT`,
    /// `AWS_REGION`, `AWS_ACCESS_KEY_ID`, `AWS_SECRET_ACCESS_KEY` and the others that AWS' own tools read.
    ///
    /// # Errors
    /// When the environment says what cannot be. Nothing is asked of the service yet.
    pub fn new(bucket: &str, prefix: &str) -> Result<Self, StoreError> {
        let retry = RetryConfig { max_retries: RETRIES, retry_timeout: RETRY, ..RetryConfig::default() };
        let is_http = ["AWS_ENDPOINT", "AWS_ENDPOINT_URL"]
            .iter()
            .any(|name| std::env::var(name).is_ok_and(|endpoint| endpoint.starts_with("http://")));
        // Who names an endpoint without TLS wants it so.
        let options = ClientOptions::new().with_connect_timeout(CONNECT).with_timeout(REQUEST).with_allow_http(is_http);
        let client =
            AmazonS3Builder::from_env().with_bucket_name(bucket).with_retry(retry).with_client_options(options);
        let opening = |cause: io::Error| io_error("opening", bucket, cause);
        let client = client.build().map_err(|error| opening(io::Error::other(error)))?;
        let runtime = Builder::new_multi_thread().worker_threads(1).thread_name("bucket").enable_all().build();
        let prefix = if prefix.is_empty() { String::new() } else { format!("{prefix}/") };
        Ok(Self { client: Arc::new(client), prefix, runtime: Some(runtime.map_err(opening)?) })
    }

    /// Waits for a request.
    fn wait<T, F>(&self, work: impl FnOnce(Arc<AmazonS3>) -> F) -> object_store::Result<T>
    where
        T: Send + 'static,
        F: Future<Output = object_store::Result<T>> + Send + 'static,
    {
        let runtime = self.runtime.as_ref().ok_or_else(|| ended("the bucket is closed"))?;
        wait(runtime.handle(), work(Arc::clone(&self.client)))
    }

    fn key(&self, key: &str) -> Result<Path, StoreError> {
        if key.split('/').all(is_part) { self.anything(key) } else { Err(StoreError::Key(key.to_owned())) }
    }

    /// The place of a path of the survey, which may be no key.
    fn anything(&self, path: &str) -> Result<Path, StoreError> {
        Path::parse(format!("{}{path}", self.prefix)).map_err(|_error| StoreError::Key(path.to_owned()))
    }

    fn put_as(&self, key: &str, bytes: &[u8], mode: PutMode) -> Result<object_store::Result<()>, StoreError> {
        let (path, payload) = (self.key(key)?, PutPayload::from(bytes.to_vec()));
        let options = PutOptions { mode, ..PutOptions::default() };
        Ok(self.wait(|client| async move { client.put_opts(&path, payload, options).await.map(|_| ()) }))
    }

    /// Writes an object of several pieces. Until the last word nobody sees any of it.
    fn put_pieces(&self, path: Path, length: u64, bytes: &mut dyn Read) -> io::Result<()> {
        let upload = self.wait(|client| async move { client.put_multipart(&path).await }).map_err(io::Error::other)?;
        let mut upload: Option<Box<dyn MultipartUpload>> = Some(upload);
        let mut put = || -> io::Result<()> {
            let mut left = length;
            while left > 0 {
                let piece = read_piece(bytes, left.min(PIECE))?;
                left -= piece.len() as u64;
                let Some(parts) = &mut upload else { break };
                let part = parts.put_part(PutPayload::from(piece));
                self.wait(|_client| part).map_err(io::Error::other)?;
            }
            if bytes.read(&mut [0])? > 0 {
                return Err(io::Error::other(format!("more than {length} bytes")));
            }
            let Some(mut parts) = upload.take() else { return Ok(()) };
            let completed = self.wait(|_client| async move {
                let result = parts.complete().await;
                Ok((parts, result))
            });
            let (parts, result) = completed.map_err(io::Error::other)?;
            if result.is_err() {
                upload = Some(parts);
            }
            result.map(|_put| ()).map_err(io::Error::other)
        };
        let result = put();
        // Parts of what did not come to its end cost room.
        if let (Err(_), Some(mut parts)) = (&result, upload) {
            let _ = self.wait(|_client| async move { parts.abort().await });
        }
        result
    }

    fn head(&self, path: Path) -> object_store::Result<Option<ObjectMeta>> {
        found(self.wait(|client| async move { client.head(&path).await }))
    }

    /// Removes an object; false when there was none. A service does not say which.
    fn remove(&self, path: Path) -> object_store::Result<bool> {
        if self.head(path.clone())?.is_none() {
            return Ok(false);
        }
        Ok(found(self.wait(|client| async move { client.delete(&path).await }))?.is_some())
    }
}

impl Drop for Bucket {
    /// Whoever drops it may be a thread that must not wait.
    fn drop(&mut self) {
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}

/// Waits for what runs elsewhere.
fn wait<T: Send + 'static>(
    runtime: &Handle,
    work: impl Future<Output = object_store::Result<T>> + Send + 'static,
) -> object_store::Result<T> {
    let (done, result) = mpsc::sync_channel(1);
    runtime.spawn(async move {
        // Nobody waits any more if this fails.
        let _ = done.send(work.await);
    });
    result.recv().unwrap_or_else(|error| Err(ended(error)))
}

fn ended(error: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Error {
    Error::Generic { store: "S3", source: error.into() }
}

/// Exactly so many bytes.
fn read_piece(bytes: &mut dyn Read, length: u64) -> io::Result<Vec<u8>> {
    let mut piece = vec![0; usize::try_from(length).map_err(io::Error::other)?];
    bytes.read_exact(&mut piece)?;
    Ok(piece)
}

/// An object that is read piece by piece, each by a request of its own: whoever reads may take hours.
struct Pieces {
    client: Arc<AmazonS3>,
    runtime: Handle,
    path: Path,
    /// Of another object at its place no piece is taken.
    tag: Option<String>,
    /// What is still to be asked for.
    rest: Range<u64>,
    piece: Cursor<Vec<u8>>,
}

impl Pieces {
    fn next(&mut self) -> object_store::Result<()> {
        let until = self.rest.end.min(self.rest.start + PIECE);
        let (client, path, range) = (Arc::clone(&self.client), self.path.clone(), self.rest.start..until);
        let options = GetOptions {
            range: Some(GetRange::Bounded(range.clone())),
            if_match: self.tag.clone(),
            ..GetOptions::default()
        };
        let piece = wait(&self.runtime, async move { client.get_opts(&path, options).await?.bytes().await })?;
        if piece.len() as u64 != range.end - range.start {
            return Err(ended(format!("{} bytes in place of {range:?}", piece.len())));
        }
        self.rest.start = until;
        self.piece = Cursor::new(piece.into());
        Ok(())
    }
}

impl Read for Pieces {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let is_read = self.piece.position() >= self.piece.get_ref().len() as u64;
        if is_read && !self.rest.is_empty() {
            self.next().map_err(io::Error::other)?;
        }
        self.piece.read(into)
    }
}

/// The first bytes of an object, and what it is.
async fn begun(client: Arc<AmazonS3>, path: Path) -> object_store::Result<(ObjectMeta, Vec<u8>)> {
    let found = client.get(&path).await?;
    let meta = found.meta.clone();
    let mut stream = found.into_stream();
    let mut first = Vec::new();
    while (first.len() as u64) < PIECE
        && let Some(more) = stream.try_next().await?
    {
        first.extend_from_slice(&more);
    }
    Ok((meta, first))
}

/// An object that is not there as nothing instead of an error.
fn found<T>(result: object_store::Result<T>) -> object_store::Result<Option<T>> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(Error::NotFound { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

fn io_error(action: &'static str, key: &str, cause: io::Error) -> StoreError {
    StoreError::Io { action, key: key.to_owned(), cause: Arc::new(cause) }
}

fn failed(action: &'static str, key: &str) -> impl Fn(Error) -> StoreError {
    move |error| io_error(action, key, io::Error::other(error))
}

fn entry(name: String, object: &ObjectMeta) -> Entry {
    Entry { name, bytes: object.size, modified: object.last_modified.into() }
}

impl Store for Bucket {
    fn get(&self, key: &str) -> Result<Option<Vec<u8>>, StoreError> {
        let path = self.key(key)?;
        let bytes = self.wait(|client| async move { client.get(&path).await?.bytes().await });
        Ok(found(bytes).map_err(failed("reading", key))?.map(Into::into))
    }

    fn open(&self, key: &str) -> Result<Option<Blob>, StoreError> {
        let path = self.key(key)?;
        let from = path.clone();
        let begun = found(self.wait(|client| begun(client, from))).map_err(failed("reading", key))?;
        let (Some((meta, first)), Some(runtime)) = (begun, &self.runtime) else { return Ok(None) };
        let pieces = Pieces {
            client: Arc::clone(&self.client),
            runtime: runtime.handle().clone(),
            path,
            tag: meta.e_tag,
            rest: first.len() as u64..meta.size,
            piece: Cursor::new(first),
        };
        Ok(Some(Blob { length: meta.size, bytes: Box::new(pieces) }))
    }

    fn put_from(&self, key: &str, length: u64, bytes: &mut dyn Read) -> Result<(), StoreError> {
        let path = self.key(key)?;
        let writing = |cause| io_error("writing", key, cause);
        if length > PIECE {
            return self.put_pieces(path, length, bytes).map_err(writing);
        }
        let all = read_piece(bytes, length).map_err(writing)?;
        if bytes.read(&mut [0]).map_err(writing)? > 0 {
            return Err(writing(io::Error::other(format!("more than {length} bytes"))));
        }
        self.put(key, &all)
    }

    fn put(&self, key: &str, bytes: &[u8]) -> Result<(), StoreError> {
        self.put_as(key, bytes, PutMode::Overwrite)?.map_err(failed("writing", key))
    }

    fn create(&self, key: &str, bytes: &[u8]) -> Result<bool, StoreError> {
        match self.put_as(key, bytes, PutMode::Create)? {
            Ok(()) => Ok(true),
            Err(Error::AlreadyExists { .. }) => Ok(false),
            Err(error) => Err(failed("writing", key)(error)),
        }
    }

    fn delete(&self, key: &str) -> Result<bool, StoreError> {
        self.remove(self.key(key)?).map_err(failed("removing", key))
    }

    fn list(&self, folder: &str) -> Result<Vec<Entry>, StoreError> {
        let path = self.key(folder)?;
        let listed = self.wait(|client| async move { client.list_with_delimiter(Some(&path)).await });
        let objects = listed.map_err(failed("listing", folder))?.objects;
        let named = objects.iter().filter_map(|object| Some((object.location.filename()?, object)));
        Ok(named.filter(|(name, _)| is_part(name)).map(|(name, object)| entry(name.to_owned(), object)).collect())
    }

    fn exists(&self, key: &str) -> Result<bool, StoreError> {
        Ok(self.head(self.key(key)?).map_err(failed("looking for", key))?.is_some())
    }

    fn used(&self, _key: &str) {}
}

impl Upkeep for Bucket {
    fn survey(&self) -> Result<Vec<Entry>, StoreError> {
        let below = (!self.prefix.is_empty()).then(|| Path::from(self.prefix.trim_end_matches('/')));
        let all = self.wait(|client| async move { client.list(below.as_ref()).try_collect::<Vec<_>>().await });
        let objects = all.map_err(failed("listing", "the store"))?;
        let name = |object: &ObjectMeta| object.location.as_ref().strip_prefix(&self.prefix).map(str::to_owned);
        Ok(objects.iter().filter_map(|object| Some(entry(name(object)?, object))).collect())
    }

    fn set_aside(&self, path: &str) -> Result<String, StoreError> {
        let from = self.anything(path)?;
        let name = path.replace('/', "_");
        let mut number = 0;
        let free = loop {
            let name = if number == 0 { name.clone() } else { format!("{name}-{number}") };
            let free = format!("{ASIDE}/{name}");
            if self.head(self.anything(&free)?).map_err(failed("looking for", &free))?.is_none() {
                break free;
            }
            number += 1;
        };
        let to = self.anything(&free)?;
        let moved = self.wait(|client| async move {
            client.copy(&from, &to).await?;
            client.delete(&from).await
        });
        moved.map_err(failed("moving", path))?;
        Ok(free)
    }

    fn discard(&self, path: &str) -> Result<bool, StoreError> {
        self.remove(self.anything(path)?).map_err(failed("removing", path))
    }
}
