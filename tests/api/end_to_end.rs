//! End to end: the real program, a real socket, a real data folder.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

mod access;
mod bad_input;
mod caching;
mod command_line;
mod crowds;
mod damage;
mod frames;
mod harness;
mod images;
mod jobs;
mod kept;
mod lifecycle;
mod observed;
mod points;
mod sun;
mod textures;
