//! What a console tells a Prometheus server that asks: the text exposition format, version 0.0.4,
//! over HTTP.

mod board;
mod families;
mod http;
mod server;
mod text;

pub use server::MetricsServer;
