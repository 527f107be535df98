//! The CI files that users copy: a gate that fails does not cost the next job a build.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use closecall_scenarios::criteria::Expression;

use crate::support::{ROOT, folder};

/// The files for GitHub, with the words that start the gate.
const GITHUB: [(&str, &str); 4] = [
    ("docs/how-to/ci/github.yml", "closecall campaign scenarios"),
    (".github/actions/campaign/action.yml", "closecall campaign \"${scenarios[@]}\""),
    ("docs/start/tutorial.md", "closecall/target/release/closecall campaign my-scenario.toml --preset pr"),
    (".github/workflows/ci.yml", "run: bash .ci/run"),
];

/// Writes a program.
#[cfg(unix)]
fn write_executable(path: &Path, text: &str) {
    use std::os::unix::fs::PermissionsExt;

    fs::write(path, text).unwrap();
    fs::set_permissions(path, fs::Permissions::from_mode(0o755)).unwrap();
}

fn text(path: &str) -> String {
    fs::read_to_string(Path::new(ROOT).join(path)).unwrap()
}

#[test]
fn a_job_on_github_saves_what_it_built_whatever_the_gate_says() {
    for (path, gate) in GITHUB {
        let text = text(path);
        let place = |words: &str| text.find(words).unwrap_or_else(|| panic!("{path} lacks {words}"));
        let (restore, save) = (place("uses: actions/cache/restore@"), place("uses: actions/cache/save@"));
        // `actions/cache` itself saves at the end of a job, and only if the job succeeds.
        assert!(!text.contains("uses: actions/cache@"), "{path}");
        assert!(restore < save, "{path}");
        let step_of_save = &text[text[..save].rfind("- ").unwrap()..save];
        assert!(save < place(gate) || step_of_save.contains("always()"), "{path}: {step_of_save}");
    }
}

#[test]
#[cfg(unix)]
fn a_second_job_on_gitlab_builds_nothing_after_a_failed_gate() {
    let yaml = text("docs/how-to/ci/gitlab.yml");
    let block = |start: &str| yaml.split_once(start).unwrap_or_else(|| panic!("{start}")).1;
    let script: Vec<&str> = block("  script:\n").lines().map_while(|line| line.strip_prefix("    - ")).collect();
    assert!(script.iter().any(|line| line.contains("cargo install")), "{script:?}");
    let cache = block("  cache:\n").split("  script:").next().unwrap();
    let kept = cache.split_once("paths: [").unwrap().1.split_once(']').unwrap().0;
    let is_kept_after_failure = cache.lines().any(|line| line.trim() == "when: always");

    let (tools, cached) = (folder(), folder());
    // A `cargo` that notes each build and installs a program whose gate fails.
    let cargo = "#!/bin/sh\necho built >> \"$BUILDS\"\nmkdir -p .closecall/bin\n\
        printf '#!/bin/sh\\n[ \"$1\" = check ]\\n' > .closecall/bin/closecall\nchmod +x .closecall/bin/closecall\n";
    write_executable(&tools.path().join("cargo"), cargo);
    let builds = tools.path().join("builds");
    for _ in 0..2 {
        let project = folder();
        let copy = |from: &Path, to: &Path| Command::new("cp").arg("-a").arg(from).arg(to).status().unwrap();
        if cached.path().join(kept).exists() {
            copy(&cached.path().join(kept), project.path());
        }
        let job = Command::new("sh")
            .args(["-e", "-c", &script.join("\n")])
            .current_dir(project.path())
            .env("PATH", format!("{}:/usr/bin:/bin", tools.path().display()))
            .env("BUILDS", &builds)
            .env("CONTROLLER", "mis")
            .output()
            .unwrap();
        assert_eq!(job.status.code(), Some(1), "{job:?}");
        if is_kept_after_failure {
            copy(&project.path().join(kept), cached.path());
        }
    }
    assert_eq!(fs::read_to_string(builds).unwrap(), "built\n");
}

/// The files in which users read a gate, and copy it.
const EXAMPLES: [&str; 5] = [
    ".github/actions/campaign/action.yml",
    "docs/how-to/ci/github.yml",
    "docs/how-to/ci/gitlab.yml",
    "docs/how-to/cluster/github.yml",
    "docs/how-to/cluster/rayjob.yaml",
];

#[test]
fn the_program_accepts_the_gates_that_the_ci_files_show() {
    let mut gates = 0;
    for path in EXAMPLES {
        let text = text(path);
        for rest in text.split("--gate ").skip(1) {
            let quote = rest.chars().next().filter(|c| matches!(c, '\'' | '"'));
            let quote = quote.unwrap_or_else(|| panic!("{path}: the gate is not quoted: {rest}"));
            let gate = rest[1..].split(quote).next().unwrap_or_default();
            assert!(gate.parse::<Expression>().is_ok(), "{path}: {gate}: {:?}", gate.parse::<Expression>());
            gates += 1;
        }
    }
    assert!(gates >= 3, "{gates}");
    assert!("max(contacts) < 1".parse::<Expression>().is_err());
}

/// Runs the step of the action that starts the campaign, with a program that prints its words and
/// ends with 1.
#[cfg(unix)]
fn step_of_campaign(home: &Path, scenarios: &str, options: &str) -> Output {
    let yaml = text(".github/actions/campaign/action.yml");
    let run = yaml.split_once("      run: |\n        code=0\n").unwrap().1;
    let script: Vec<&str> = run.lines().map_while(|line| line.strip_prefix("        ")).collect();
    let program = home.join(".closecall/bin/closecall");
    fs::create_dir_all(program.parent().unwrap()).unwrap();
    write_executable(&program, "#!/bin/sh\nprintf '<%s>' \"$@\"\nexit 1\n");
    // As GitHub runs a step with `shell: bash`.
    Command::new("bash")
        .args(["--noprofile", "--norc", "-e", "-o", "pipefail", "-c", &format!("code=0\n{}", script.join("\n"))])
        .envs([("HOME", home), ("RUNNER_TEMP", home)])
        .envs([("SCENARIOS", scenarios), ("PRESET", "pr"), ("SEED", "1"), ("CONTROLLER", "exec:python3 my.py")])
        .envs([("OPTIONS", options), ("OUT", "out")])
        .env("GITHUB_OUTPUT", home.join("output"))
        .output()
        .unwrap()
}

#[test]
#[cfg(unix)]
fn the_action_carries_a_quoted_gate() {
    let home = folder();
    let options = "--gate 'upper(induced) <= 0.03' --max-induced 0 '$(touch x)'";
    let job = step_of_campaign(home.path(), "a b", options);
    assert_eq!(job.status.code(), Some(1), "{job:?}");
    let words = String::from_utf8(job.stdout).unwrap();
    assert!(words.starts_with("<campaign><a><b><--preset>"), "{words}");
    assert!(words.contains("<--controller><exec:python3 my.py>"), "{words}");
    assert!(words.ends_with("<--gate><upper(induced) <= 0.03><--max-induced><0><$(touch x)>"), "{words}");
    let without = step_of_campaign(home.path(), "a", "");
    assert!(String::from_utf8(without.stdout).unwrap().ends_with("<--out><out>"), "no option is no word");
}

#[test]
#[cfg(unix)]
fn the_action_ends_with_an_error_if_a_quote_is_not_closed() {
    let wrong = "--max-other-collisions 5 '--gate=upper(induced) <= 0.01";
    for (scenarios, options, input) in [("a", wrong, "options"), ("a \"b", "", "scenarios"), ("a", "it's", "options")] {
        let home = folder();
        let job = step_of_campaign(home.path(), scenarios, options);
        assert_eq!(job.status.code(), Some(2), "{job:?}");
        assert_eq!(String::from_utf8_lossy(&job.stdout), "", "no campaign runs");
        let told = String::from_utf8_lossy(&job.stderr).into_owned();
        assert!(told.contains(&format!("::error::closecall: the input `{input}`")), "{told}");
        assert_eq!(fs::read_to_string(home.path().join("output")).unwrap(), "exit-code=2\n");
    }
}

/// No step reads words from a command whose failure the shell drops.
#[test]
fn no_step_reads_a_command_whose_failure_is_dropped() {
    for path in GITHUB.iter().map(|(path, _)| *path).chain(EXAMPLES) {
        let text = text(path);
        for dropped in ["< <(", "<(words", "|| true"] {
            assert!(!text.contains(dropped), "{path}: {dropped}");
        }
        let unquoted = |line: &&str| {
            !line.trim_start().starts_with('#') && line.contains("closecall campaign $") && !line.contains("\"$")
        };
        assert_eq!(
            text.lines().find(unquoted),
            None,
            "{path}: the words of a variable without quotes lose a quoted gate"
        );
    }
}

#[test]
#[cfg(target_os = "linux")]
fn the_action_takes_a_release_with_the_right_checksum_and_no_other() {
    let yaml = text(".github/actions/campaign/action.yml");
    let run = yaml.split_once("TAG: ${{ github.action_ref }}\n      run: |\n").unwrap().1;
    let script: Vec<&str> = run.lines().map_while(|line| line.strip_prefix("        ")).collect();
    // A server of releases that is a folder.
    let curl = "#!/bin/sh\nwhile [ $# -gt 2 ]; do [ \"$1\" = -o ] && to=$2; shift; done\ncp \"$2\" \"$to\"\n";
    for (case, expected, is_there) in [("right", Some(0), "true"), ("none", Some(0), "false"), ("wrong", Some(1), "")] {
        let (home, tools, server) = (folder(), folder(), folder());
        write_executable(&tools.path().join("curl"), curl);
        let name = format!("closecall-v1-{}-unknown-linux-gnu", std::env::consts::ARCH);
        let release = server.path().join("v1");
        fs::create_dir_all(release.join(&name)).unwrap();
        write_executable(&release.join(&name).join("closecall"), "#!/bin/sh\n");
        if case != "none" {
            let pack = format!(
                "cd {} && tar -czf {name}.tar.gz {name} && sha256sum {name}.tar.gz > SHA256SUMS",
                release.display()
            );
            assert!(Command::new("sh").args(["-c", &pack]).status().unwrap().success());
        }
        if case == "wrong" {
            fs::write(release.join("SHA256SUMS"), format!("{}  {name}.tar.gz\n", "0".repeat(64))).unwrap();
        }
        let path = format!("{}:{}", tools.path().display(), std::env::var("PATH").unwrap());
        let job = Command::new("bash")
            .args(["-e", "-c", &script.join("\n")])
            .envs([("HOME", home.path()), ("RUNNER_TEMP", home.path()), ("RELEASES", server.path())])
            .envs([("TAG", "v1"), ("PATH", &path)])
            .env("GITHUB_OUTPUT", home.path().join("output"))
            .output()
            .unwrap();
        assert_eq!(job.status.code(), expected, "{case}: {job:?}");
        let output = fs::read_to_string(home.path().join("output")).unwrap_or_default();
        assert!(is_there.is_empty() || output == format!("is-there={is_there}\n"), "{case}: {output}");
        assert_eq!(home.path().join(".closecall/bin/closecall").exists(), case == "right", "{case}");
    }
}
