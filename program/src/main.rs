//! The standalone program.

mod allocator;
mod bench;
mod demo;
mod histogram;
mod info;
mod render;
mod steps;

use anyhow::Result;
use clap::{ArgAction, CommandFactory, FromArgMatches, Parser, Subcommand};
use halite::gpu::DeviceChoice;
use halite::render::Renderer;
use halite_console::{output, parse};
use halite_study::{sheets, tables};
use std::path::Path;
use std::process::ExitCode;

/// Draws unstructured grids as volumes: every pixel is the integral of the field that the mesh defines.
#[derive(Parser)]
#[command(name = "halite", version, arg_required_else_help = true, max_term_width = 110)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Threads to work with; 0 is one for each core
    #[arg(long, global = true, value_name = "N", default_value_t = 0, value_parser = parse::threads)]
    threads: usize,
    /// Say on stderr what is chosen and left out
    #[arg(short, long, global = true)]
    verbose: bool,
}

#[derive(Subcommand)]
enum Command {
    Render(Box<render::Options>),
    Info(info::Options),
    Bench(Box<bench::Options>),
    Study(Box<sheets::Options>),
    Tables(Box<tables::Options>),
    Histogram(Box<histogram::Options>),
    Demo(demo::Options),
}

#[global_allocator]
static MEMORY: allocator::Ending = allocator::Ending;

fn main() -> ExitCode {
    hush_mesa();
    let cli = match Cli::from_arg_matches(&numbers_are_values(Cli::command()).get_matches()) {
        Ok(cli) => cli,
        Err(misuse) => misuse.exit(),
    };
    let level = if cli.verbose { tracing::Level::INFO } else { tracing::Level::WARN };
    tracing_subscriber::fmt()
        .with_max_level(level)
        .with_writer(std::io::stderr)
        .with_ansi(false)
        .with_target(false)
        .without_time()
        .init();
    match run(cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => match error.downcast::<clap::Error>() {
            Ok(misuse) => misuse.exit(),
            Err(error) => {
                output::error(&error);
                ExitCode::FAILURE
            }
        },
    }
}

/// Has every option that takes a value take `-1` as one, to say what is wrong with it, and not as an option.
fn numbers_are_values(command: clap::Command) -> clap::Command {
    let takes = |action: &ArgAction| matches!(action, ArgAction::Set | ArgAction::Append);
    let command = command.mut_args(|arg| {
        let numbers = takes(arg.get_action()) && !arg.is_positional();
        if numbers { arg.allow_negative_numbers(true) } else { arg }
    });
    command.mut_subcommands(numbers_are_values)
}

/// Mesa's selection of devices asks Wayland, which complains on stderr where there is no session.
#[allow(unsafe_code, reason = "set_var is unsafe where other threads run; here none does yet")]
fn hush_mesa() {
    if std::env::var_os("XDG_RUNTIME_DIR").is_none_or(|folder| !Path::new(&folder).is_absolute()) {
        // SAFETY: the process has one thread.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") }
    }
}

fn run(cli: Cli) -> Result<()> {
    match cli.command {
        Command::Render(options) => render::run(&options, cli.threads),
        Command::Info(options) => {
            Renderer::with_device(cli.threads, DeviceChoice::Cpu)?.install(|| info::run(&options))
        }
        Command::Bench(options) => bench::run(&options, cli.threads),
        Command::Study(options) => sheets::run(&options, cli.threads),
        Command::Tables(options) => tables::run(&options, cli.threads),
        Command::Histogram(options) => histogram::run(&options, cli.threads),
        Command::Demo(options) => demo::run(&options, &mut Renderer::new(cli.threads)?),
    }
}
