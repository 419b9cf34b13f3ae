//! Which engines are installed: Python modules and programs on the search path.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use super::{Engine, child};
use crate::io::settings;
use crate::watch::Watch;

/// A Python that does not answer for so long has none of the modules.
const PATIENCE: Duration = Duration::from_secs(20);
const QUESTION: &str = "import importlib.util as u\n\
                        print('modules', *[n for n in ('openmvg_rs', 'pycolmap') if u.find_spec(n)])";

/// Where engines are looked for.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Places {
    /// Folders of programs, as `PATH` has them.
    pub path: OsString,
    /// A virtual environment of Python for engines alone: Debian's own Python takes no packages of
    /// `pip`.
    pub environment: Option<PathBuf>,
}

/// An engine, and whether it is there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Installed {
    pub engine: Engine,
    /// The program that runs it; `None` where it is not installed.
    pub program: Option<PathBuf>,
    /// The line for a terminal that installs it.
    pub install: String,
}

impl Places {
    /// Those of this system.
    pub fn of_system() -> Self {
        Self {
            path: std::env::var_os("PATH").unwrap_or_default(),
            environment: settings::data().map(|folder| folder.join("engines")),
        }
    }

    /// An engine that is not there.
    pub(super) fn missing(&self, engine: Engine) -> Installed {
        let install = match (engine, &self.environment) {
            (Engine::Colmap, _) => "sudo apt install colmap".to_owned(),
            (_, Some(folder)) if cfg!(unix) => {
                let folder = folder.display();
                let name = engine.name();
                format!("python3 -m venv \"{folder}\" && \"{folder}/bin/pip\" install {name}")
            }
            _ => format!("pip install {}", engine.name()),
        };
        Installed { engine, program: None, install }
    }

    fn program(&self, name: &str) -> Option<PathBuf> {
        let file = format!("{name}{}", std::env::consts::EXE_SUFFIX);
        std::env::split_paths(&self.path)
            .map(|folder| folder.join(&file))
            .find(|own| is_program(own))
    }

    /// Pythons in which modules are looked for.
    fn pythons(&self) -> Vec<PathBuf> {
        let bin = if cfg!(windows) { "Scripts/python.exe" } else { "bin/python3" };
        let own = self.environment.iter().map(|folder| folder.join(bin));
        let own = own.filter(|own| is_program(own));
        own.chain(self.program("python3").or_else(|| self.program("python"))).collect()
    }
}

/// Every engine in the order of [`Engine::ALL`]. Programs are started to ask for modules: not for
/// the thread of a window.
pub fn look(places: &Places) -> Vec<Installed> {
    let mut all: Vec<Installed> = Engine::ALL.map(|engine| places.missing(engine)).into();
    for python in places.pythons() {
        let modules = modules(&python);
        for own in all.iter_mut().filter(|own| own.program.is_none()) {
            if own.engine.module().is_some_and(|name| modules.iter().any(|own| own == name)) {
                own.program = Some(python.clone());
            }
        }
    }
    let colmap = all.iter_mut().find(|own| own.engine == Engine::Colmap);
    if let Some(own) = colmap {
        own.program = places.program("colmap");
    }
    all
}

fn modules(python: &Path) -> Vec<String> {
    let mut command = Command::new(python);
    command.args(["-c", QUESTION]);
    let mut modules = Vec::new();
    let mut take = |line: &str| {
        if let Some(names) = line.strip_prefix("modules ") {
            modules = names.split_whitespace().map(str::to_owned).collect();
        }
    };
    // A Python that does not work has no modules.
    let _ = child::run(Engine::OpenMvg, command, PATIENCE, &Watch::new(), &mut take);
    modules
}

fn is_program(file: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        file.metadata().is_ok_and(|own| own.is_file() && own.permissions().mode() & 0o111 != 0)
    }
    #[cfg(not(unix))]
    file.is_file()
}
