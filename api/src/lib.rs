//! HTTP service and command line of skyloom: registers skies and images, renders their textures on one thread that owns
//! the graphics device, and answers with replies that may be cached for ever.

pub mod accept;
pub mod access;
pub mod ambient;
pub mod app;
pub mod around;
pub mod body;
pub mod budget;
pub mod cli;
pub mod client;
pub mod config;
pub mod connections;
pub mod deliver;
pub mod fair;
pub mod files;
pub mod frames;
pub mod gate;
pub mod images;
pub mod logs;
pub mod metrics;
pub mod presets;
pub mod problem;
pub mod render_queue;
pub mod replies;
pub mod routes;
pub mod serve;
pub mod shelf;
pub mod single_flight;
pub mod skies;
pub mod store_health;
pub mod sun;
pub mod table_work;
pub mod textures;
pub mod version;
pub mod viewer;
pub mod watched;
