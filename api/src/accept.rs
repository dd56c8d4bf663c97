//! Taking connections, and serving each as long as it is used.

use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::Router;
use hyper::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::{Service as _, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::server::graceful::{GracefulShutdown, Watcher};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;

use crate::app::App;
use crate::client::{Client, network};
use crate::connections::{Connections, Cut, Place};
use crate::leftover::Leftover;
use crate::unread::Unread;
use crate::watched::{Reply, Watched};

/// Pause after a connection could not be accepted (out of file descriptors, usually).
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);
/// How often connections are looked at.
const SWEEP: Duration = Duration::from_millis(250);
/// How long a new connection waits for a place before it is refused.
const PATIENCE: Duration = Duration::from_secs(5);
/// Sent to a connection for which there is no place.
const NO_PLACE: &[u8] = b"HTTP/1.1 503 Service Unavailable\r\nRetry-After: 5\r\nCache-Control: no-store\r\n\
                          Content-Length: 0\r\nConnection: close\r\n\r\n";

/// Where connections come in.
#[derive(Debug)]
pub struct Door {
    app: Arc<App>,
    router: Router,
    connections: Arc<Connections>,
    /// Connections that may wait for a place: as many as there are places.
    waiting: Arc<Semaphore>,
}

impl Door {
    /// Leads to `router`; `connections` has the places.
    pub fn new(app: Arc<App>, router: Router, connections: Arc<Connections>) -> Self {
        let waiting = Arc::new(Semaphore::new(app.config.server.connections));
        Self { app, router, connections, waiting }
    }

    /// Takes connections, for ever.
    pub async fn open(&self, listener: TcpListener, graceful: &GracefulShutdown) {
        let take = async {
            loop {
                match listener.accept().await {
                    Ok((stream, peer)) => self.take(stream, peer, graceful.watcher()),
                    Err(error) => {
                        tracing::warn!(%error, "a connection could not be accepted");
                        tokio::time::sleep(ACCEPT_PAUSE).await;
                    }
                }
            }
        };
        let sweep = async {
            loop {
                tokio::time::sleep(SWEEP).await;
                self.connections.sweep(&self.app.config.server);
            }
        };
        tokio::join!(take, sweep);
    }

    /// Serves a connection as soon as there is a place for it. Whoever has to wait for one keeps nobody else waiting.
    fn take(&self, stream: TcpStream, peer: SocketAddr, watcher: Watcher) {
        let address = network(peer.ip());
        let (app, connections, router) = (Arc::clone(&self.app), Arc::clone(&self.connections), self.router.clone());
        let place = connections.admit(address, &app.config.server);
        let waits = if place.is_none() { Arc::clone(&self.waiting).try_acquire_owned().ok() } else { None };
        if place.is_none() && waits.is_none() {
            return refuse(&stream, &connections);
        }
        tokio::spawn(async move {
            let place = match place {
                Some(place) => Some(place),
                None => connections.place(address, &app.config.server, Instant::now() + PATIENCE).await,
            };
            drop(waits);
            match place {
                Some(place) => serve(app, stream, peer.ip(), place, router, watcher).await,
                None => refuse(&stream, &connections),
            }
        });
    }
}

/// Sends a connection away.
fn refuse(stream: &TcpStream, connections: &Connections) {
    connections.count(Cut::Refused);
    // Whoever reads nothing misses nothing.
    stream.try_write(NO_PLACE).unwrap_or_default();
}

/// Serves one connection.
async fn serve(app: Arc<App>, stream: TcpStream, address: IpAddr, place: Place, router: Router, watcher: Watcher) {
    if let Err(error) = stream.set_nodelay(true) {
        tracing::debug!(%error, "set_nodelay");
    }
    let connection = Arc::clone(&place.connection);
    let watched = Watched::new(stream, Arc::clone(&connection), Unread::new(Arc::clone(&app), address));
    let router = TowerToHyperService::new(router);
    let service = service_fn(move |request: Request<Incoming>| {
        connection.request();
        let (mut request, leftover) = Leftover::of(request);
        let client = Client::behind(address, request.headers(), &app.config.server.proxies);
        request.extensions_mut().insert(client);
        request.extensions_mut().insert(Arc::clone(&connection));
        let (answer, connection) = (router.call(request), Arc::clone(&connection));
        async move {
            let mut answer = answer.await?;
            leftover.read(&connection, &mut answer).await;
            Ok::<_, std::convert::Infallible>(answer.map(|body| Reply::new(body, connection)))
        }
    });
    // Heads have their time from the sweeps, as all else.
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(None)
        .serve_connection(TokioIo::new(watched), service);
    tokio::select! {
        ended = watcher.watch(connection) => {
            if let Err(error) = ended {
                tracing::debug!(%error, "a connection ended early");
            }
        }
        () = place.connection.is_cut() => {}
    }
}
