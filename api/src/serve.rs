//! Listening, serving connections, and stopping without cutting anyone off.

use std::fmt;
use std::io::{self, ErrorKind, Write as _};
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use hyper_util::server::graceful::GracefulShutdown;
use tokio::net::{TcpListener, TcpSocket};

use crate::accept::Door;
use crate::app::{App, OpenError};
use crate::config::{Config, Listen};
use crate::jobs::Jobs;
use crate::render_queue::{Factory, core_factory};
use crate::{routes, upkeep};

/// How long the render thread gets to let go of the device when everything else has ended.
const FAREWELL: Duration = Duration::from_secs(5);

/// Bytes that the system keeps of what was written to a connection and not yet read: it would take megabytes, for each client
/// that reads nothing, and would tell late of one that reads slowly. A reader far away gets 5 MB/s with it.
const SEND_BUFFER: u32 = 256 << 10;
/// Connections that the system keeps until they are accepted.
const BACKLOG: u32 = 1024;

/// What kept the server from starting.
#[derive(Debug)]
pub enum ServeError {
    /// The system gives no threads.
    Threads(io::Error),
    /// The signals that stop the server cannot be heard.
    Signals(io::Error),
    /// The address cannot be listened on.
    Listen(Listen, io::Error),
    /// The service could not be opened on this data folder.
    Open(String, OpenError),
    /// Nobody can be told the address.
    Stdout(io::Error),
    /// It served, and ended as a renderer hangs.
    Hung,
}

impl fmt::Display for ServeError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Threads(error) => write!(out, "starting threads: {error}"),
            Self::Signals(error) => write!(out, "signal handler: {error}"),
            Self::Listen(listen, error) => out.write_str(&not_listening(listen, error)),
            Self::Open(place, error) => write!(out, "{place}: {error}"),
            Self::Stdout(error) => write!(out, "writing to stdout: {error}"),
            Self::Hung => {
                out.write_str("a call to the graphics driver does not return: the server is to be started again")
            }
        }
    }
}

impl std::error::Error for ServeError {}

/// Serves until SIGTERM or SIGINT, or until a renderer hangs: no thread can leave a call that does not return, but a new process is
/// rid of it.
pub fn serve(config: Config) -> Result<(), ServeError> {
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().map_err(ServeError::Threads)?;
    let result = runtime.block_on(async {
        let factory = core_factory(config.render.wanted(), config.render.kept_bytes);
        run(config, factory).await
    });
    // Tables that are still being computed hold no data of users; they are not waited for.
    runtime.shutdown_background();
    result
}

async fn run(config: Config, factory: Factory) -> Result<(), ServeError> {
    let mut stop = StopSignals::install()?;
    let (listener, address) = listening(&config.server.listen)?;
    let admin = match &config.server.admin_listen {
        Some(listen) => Some(listening(listen)?),
        None => None,
    };
    let place = config.place();
    let app = App::open(config, factory).map_err(|error| ServeError::Open(place.clone(), error))?;
    let app = Arc::new(app);
    Jobs::start(&app);
    tokio::spawn(upkeep::sweep(Arc::clone(&app)));
    let admin_address = admin.as_ref().map(|(_, address)| *address);
    announce(address, admin_address).map_err(ServeError::Stdout)?;
    tracing::info!(%address, store = %place, version = %*skyloom::VERSION, "listening");

    let connections = accept(&app, listener, admin.map(|(listener, _)| listener), &mut stop).await;
    let grace = Duration::from_secs(app.config.server.grace_s);
    tokio::select! {
        () = connections.shutdown() => tracing::info!("all connections ended"),
        () = tokio::time::sleep(grace) => tracing::warn!("some requests did not finish in time"),
        _ = stop.received() => tracing::warn!("told to stop a second time: running requests are cut off"),
    }
    app.queue.close(FAREWELL);
    if app.queue.is_hung() { Err(ServeError::Hung) } else { Ok(()) }
}

fn listening(listen: &Listen) -> Result<(TcpListener, SocketAddr), ServeError> {
    let failed = |error| ServeError::Listen(listen.clone(), error);
    let mut listener = Err(ErrorKind::AddrNotAvailable.into());
    for address in listen.addresses() {
        listener = listening_at(*address);
        if listener.is_ok() {
            break;
        }
    }
    let listener = listener.map_err(failed)?;
    let address = listener.local_addr().map_err(failed)?;
    Ok((listener, address))
}

fn listening_at(address: SocketAddr) -> io::Result<TcpListener> {
    let socket = if address.is_ipv4() { TcpSocket::new_v4() } else { TcpSocket::new_v6() }?;
    // As `TcpListener::bind` does.
    #[cfg(unix)]
    socket.set_reuseaddr(true)?;
    socket.set_send_buffer_size(SEND_BUFFER)?;
    socket.bind(address)?;
    socket.listen(BACKLOG)
}

/// Why a place could not be listened on, and what to do about it.
fn not_listening(listen: &Listen, error: &io::Error) -> String {
    let host = listen.to_string();
    let host = host.rsplit_once(':').map_or(host.as_str(), |(host, _)| host);
    let advice = match error.kind() {
        ErrorKind::AddrInUse => format!(
            "another program listens there, perhaps a server that still runs. Stop it, or choose another port: --listen \
             {host}:0 takes any that is free"
        ),
        ErrorKind::PermissionDenied => format!(
            "this user may not listen there; ports below 1024 are usually kept for the system. Choose a higher one, such \
             as --listen {host}:8080"
        ),
        ErrorKind::AddrNotAvailable => {
            "this machine has no such address. --listen 127.0.0.1:8080 is one that every machine has".to_owned()
        }
        _ => "choose another place with --listen ADDRESS:PORT".to_owned(),
    };
    format!("listening on {listen}: {error}: {advice}")
}

/// What stdout says, for scripts that asked for port 0: a line, and a second one if probes have a listener of their own.
fn announce(address: SocketAddr, admin: Option<SocketAddr>) -> io::Result<()> {
    let probes = admin.map_or_else(String::new, |admin| format!("probes on http://{admin}\n"));
    let mut stdout = io::stdout().lock();
    // In one go: who reads the first line may close the pipe then.
    stdout.write_all(format!("listening on http://{address}\n{probes}").as_bytes())?;
    stdout.flush()
}

/// Takes connections until told to stop; gives those that are still open. Probes are answered for as long as the program runs.
async fn accept(
    app: &Arc<App>,
    listener: TcpListener,
    admin: Option<TcpListener>,
    stop: &mut StopSignals,
) -> GracefulShutdown {
    let graceful = GracefulShutdown::new();
    let door = Door::new(Arc::clone(app), routes::router(Arc::clone(app)), Arc::clone(&app.connections));
    if let Some(listener) = admin {
        let door = Door::new(Arc::clone(app), routes::admin(Arc::clone(app)), Arc::default());
        tokio::spawn(async move { door.open(listener, &GracefulShutdown::new()).await });
    }
    let stopped = async {
        let is_orderly = tokio::select! {
            why = stop.received() => why == Stop::Orderly,
            // What was in memory is sent to its end.
            () = app.queue.hung() => true,
        };
        if is_orderly {
            app.drain();
            let drain = Duration::from_secs(app.config.server.drain_s);
            tracing::info!(drain_s = drain.as_secs(), "stopping: no longer ready");
            tokio::time::sleep(drain).await;
        }
    };
    tokio::select! {
        () = door.open(listener, &graceful) => {}
        () = stopped => {}
    }
    app.stop();
    tracing::info!("stopping: running requests are finished, new connections refused");
    graceful
}

/// Why the server stops.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stop {
    /// SIGTERM: a supervisor takes it out of service first.
    Orderly,
    /// SIGINT: somebody waits at a terminal.
    AtOnce,
}

#[cfg(unix)]
struct StopSignals {
    terminate: tokio::signal::unix::Signal,
    interrupt: tokio::signal::unix::Signal,
}

#[cfg(unix)]
impl StopSignals {
    fn install() -> Result<Self, ServeError> {
        use tokio::signal::unix::{SignalKind, signal};
        let install = |kind| signal(kind).map_err(ServeError::Signals);
        Ok(Self { terminate: install(SignalKind::terminate())?, interrupt: install(SignalKind::interrupt())? })
    }

    async fn received(&mut self) -> Stop {
        tokio::select! {
            _ = self.terminate.recv() => Stop::Orderly,
            _ = self.interrupt.recv() => Stop::AtOnce,
        }
    }
}

#[cfg(not(unix))]
struct StopSignals;

#[cfg(not(unix))]
impl StopSignals {
    fn install() -> Result<Self, ServeError> {
        Ok(Self)
    }

    async fn received(&mut self) -> Stop {
        if tokio::signal::ctrl_c().await.is_err() {
            std::future::pending::<()>().await;
        }
        Stop::AtOnce
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use super::*;

    #[test]
    fn what_keeps_the_server_from_listening_says_what_to_do() {
        let told = |listen: &str, kind: ErrorKind| not_listening(&listen.parse().unwrap(), &kind.into());
        let taken = told("[::1]:8080", ErrorKind::AddrInUse);
        assert!(taken.contains("on [::1]:8080") && taken.contains("--listen [::1]:0"), "{taken}");
        assert!(told("127.0.0.1:80", ErrorKind::PermissionDenied).contains("--listen 127.0.0.1:8080"));
        assert!(told("192.0.2.1:80", ErrorKind::AddrNotAvailable).contains("no such address"));
    }
}
