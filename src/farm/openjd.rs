//! A template of Open Job Description (2023-09), which AWS Deadline Cloud and others run.

use std::fmt::Write;
use std::path::Path;

use super::job::FarmJob;
use super::quote::{power_shell, shell_words, yaml};

/// Which machines a template is for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WorkerSystem {
    /// Machines with a POSIX shell.
    #[default]
    Linux,
    /// Machines with PowerShell.
    Windows,
}

/// What is asked of a template.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OpenJdOptions {
    /// Which machines run it.
    pub system: WorkerSystem,
    /// Seconds that a chunk is to take, where the scheduler makes chunks (the extension TASK_CHUNKING); without it, the
    /// tasks are those of the plan, balanced by cost.
    pub chunk_seconds: Option<u32>,
    /// Cores of a worker at least; the plan's estimate where it is not given.
    pub cores: Option<u32>,
    /// The folder of the template, as an absolute path.
    pub folder: String,
}

impl OpenJdOptions {
    /// A path as the default of a parameter: defaults are relative to the template's folder and lead down, or else there
    /// is none. (`openjd check` passes others, and `openjd run` then refuses them.)
    fn default_of(&self, path: &str) -> Option<String> {
        let below = Path::new(path).strip_prefix(&self.folder).ok()?;
        let parts: Option<Vec<&str>> = below.components().map(|part| part.as_os_str().to_str()).collect();
        parts.map(|parts| parts.join("/")).filter(|below| !below.is_empty())
    }

    /// What has to be given when the job is submitted, since it has no default.
    pub fn missing(&self, job: &FarmJob) -> Vec<String> {
        let all = [("Input", &job.input), ("Output", &job.folder)];
        let without = all.into_iter().filter(|(_, path)| self.default_of(path).is_none());
        without.flat_map(|(name, path)| ["-p".to_string(), format!("{name}={path}")]).collect()
    }
}

/// The template, as YAML.
pub fn template(job: &FarmJob, options: &OpenJdOptions) -> String {
    let mut text = head(job, options);
    let parameters = parameters(job, options);
    text += &definitions(&parameters);
    text += "steps:\n";
    text += &render_step(job, options, &parameters);
    text += &check_step(job, options, &parameters);
    text
}

fn head(job: &FarmJob, options: &OpenJdOptions) -> String {
    let count = job.tasks.tasks.len();
    let given = options.missing(job);
    let given = if given.is_empty() { String::new() } else { format!(" {}", shell_words(&given)) };
    let mut text = format!(
        "# {name}: a job template of Open Job Description. Written by anim {version}.\n#\n\
         #   openjd check THIS\n\
         #   openjd run THIS --step Render{given}\n\
         #   openjd run THIS --step Render{given} -p Samples=4 -p Frames=1-10\n",
        name = job.name.replace(['\n', '\r'], " "),
        version = env!("CARGO_PKG_VERSION"),
    );
    if options.chunk_seconds.is_none() {
        let _ = write!(
            text,
            "#\n# Task, share of the cost, frames (of the frames below, in {count} tasks):\n{}",
            job.task_lines("# ")
        );
        if let Some(line) = job.price_line() {
            let _ = writeln!(text, "# {line}.");
        }
    }
    text += "specificationVersion: jobtemplate-2023-09\n";
    if options.chunk_seconds.is_some() {
        text += "extensions: [TASK_CHUNKING]\n";
    }
    let name: String = job.name.chars().filter(|c| !c.is_control()).take(100).collect();
    let _ = writeln!(text, "name: {}", yaml(&format!("anim {name}")));
    text
}

/// A parameter of the job: declared once, in the template's definitions, and handed to every script in this order.
struct JobParameter {
    name: &'static str,
    kind: &'static str,
    /// More lines of its definition.
    more: &'static str,
    default: Option<String>,
    about: &'static str,
    /// What scripts call it.
    variable: &'static str,
}

fn parameters(job: &FarmJob, options: &OpenJdOptions) -> Vec<JobParameter> {
    let path = |path: &str| options.default_of(path).map(|path| yaml(&path));
    let size_about = "In pixels; 0: as the scene says.";
    let count = |name, variable, about| JobParameter {
        name,
        kind: "INT",
        more: "  minValue: 0\n",
        default: Some("0".into()),
        about,
        variable,
    };
    let mut all = vec![
        JobParameter {
            name: "Input",
            kind: "PATH",
            more: "  objectType: FILE\n  dataFlow: IN\n",
            default: path(&job.input),
            about: "The script, scene or archive.",
            variable: "show",
        },
        JobParameter {
            name: "Output",
            kind: "PATH",
            more: "  objectType: DIRECTORY\n  dataFlow: OUT\n",
            default: path(&job.folder),
            about: "The folder of the frames.",
            variable: "folder",
        },
        JobParameter {
            name: "Frames",
            kind: "STRING",
            more: "",
            default: Some(yaml(&job.frames.replace('x', ":"))),
            about: "Ascending ranges, as in 1-10,20,30-60:5.",
            variable: "frames",
        },
        count("Width", "width", size_about),
        count("Height", "height", size_about),
        count("Samples", "samples", "Samples per pixel; 0: as the scene says."),
        JobParameter {
            name: "Anim",
            kind: "STRING",
            more: "",
            default: Some(yaml(&job.anim)),
            about: "The program on the workers.",
            variable: "anim",
        },
    ];
    if options.chunk_seconds.is_none() {
        all.push(JobParameter {
            name: "Tasks",
            kind: "INT",
            more: "  minValue: 1\n",
            default: Some(job.tasks.tasks.len().to_string()),
            about: "Into how many parts of about the same cost.",
            variable: "tasks",
        });
    }
    all
}

fn definitions(parameters: &[JobParameter]) -> String {
    let mut text = String::from("parameterDefinitions:\n");
    for JobParameter { name, kind, more, default, about, variable: _ } in parameters {
        let default = default.as_ref().map_or(String::new(), |default| format!("  default: {default}\n"));
        let _ = writeln!(text, "- name: {name}\n  type: {kind}\n{more}{default}  description: {}", yaml(about));
    }
    text
}

/// How a script is run. Values of parameters are arguments, so that no quote or blank in them is read as code; what a task
/// is comes last.
fn action(options: &OpenJdOptions, parameters: &[JobParameter], task: Option<&str>) -> String {
    let (command, first): (&str, &[&str]) = match options.system {
        WorkerSystem::Linux => ("bash", &["{{Task.File.Run}}"]),
        WorkerSystem::Windows => {
            ("powershell", &["-NoProfile", "-ExecutionPolicy", "Bypass", "-File", "{{Task.File.Run}}"])
        }
    };
    let values = parameters.iter().map(|parameter| format!("{{{{Param.{}}}}}", parameter.name));
    let values = values.chain(task.map(|task| format!("{{{{Task.Param.{task}}}}}")));
    let words: Vec<String> = first.iter().map(|word| yaml(word)).chain(values.map(|value| yaml(&value))).collect();
    format!(
        "    actions:\n      onRun:\n        command: {command}\n        args: [{}]\n        cancelation:\n          \
         mode: NOTIFY_THEN_TERMINATE\n          notifyPeriodInSeconds: 60\n",
        words.join(", ")
    )
}

fn embedded(options: &OpenJdOptions, script: &str) -> String {
    let file = match options.system {
        WorkerSystem::Linux => "run.sh",
        WorkerSystem::Windows => "run.ps1",
    };
    let body: String = script.lines().map(|line| format!("        {line}\n")).collect();
    format!(
        "    embeddedFiles:\n    - name: Run\n      type: TEXT\n      filename: {file}\n      data: |\n{}",
        body.replace("        \n", "\n")
    )
}

/// Which machines may run a step: every script is written for one shell.
fn host_attributes(options: &OpenJdOptions) -> String {
    let family = match options.system {
        WorkerSystem::Linux => "linux",
        WorkerSystem::Windows => "windows",
    };
    format!("  hostRequirements:\n    attributes:\n    - name: attr.worker.os.family\n      anyOf: [{family}]\n")
}

fn render_step(job: &FarmJob, options: &OpenJdOptions, parameters: &[JobParameter]) -> String {
    let mut text = format!("- name: Render\n{}", host_attributes(options));
    let cores = options.cores.unwrap_or(job.tasks.cores);
    let _ = write!(
        text,
        "    amounts:\n    - name: amount.worker.vcpu\n      min: {cores}\n    - name: amount.worker.memory\n      \
         min: {}\n",
        job.tasks.memory_bytes >> 20
    );
    text += "  parameterSpace:\n    taskParameterDefinitions:\n";
    let task = match options.chunk_seconds {
        Some(seconds) => {
            let count = job.tasks.tasks.len().max(1);
            let frames: usize = job.tasks.tasks.iter().map(|task| task.frames.len()).sum();
            let _ = write!(
                text,
                "    - name: Chunk\n      type: CHUNK[INT]\n      range: \"{{{{Param.Frames}}}}\"\n      chunks:\n        \
                 defaultTaskCount: {}\n        targetRuntimeSeconds: {seconds}\n        rangeConstraint: CONTIGUOUS\n",
                frames.div_ceil(count).max(1)
            );
            "Chunk"
        }
        None => {
            text += "    - name: Task\n      type: INT\n      range: \"1-{{Param.Tasks}}\"\n";
            "Task"
        }
    };
    text += "  script:\n";
    text += &embedded(options, &render_script(job, options, parameters));
    text + &action(options, parameters, Some(task))
}

fn check_step(job: &FarmJob, options: &OpenJdOptions, parameters: &[JobParameter]) -> String {
    let mut text = format!("- name: Check\n  dependencies:\n  - dependsOn: Render\n{}", host_attributes(options));
    text += "  script:\n";
    text += &embedded(options, &check_script(job, options, parameters));
    text + &action(options, parameters, None)
}

/// What both scripts begin with: their arguments, and the shot with its settings.
fn shot_lines(job: &FarmJob, options: &OpenJdOptions, parameters: &[JobParameter]) -> String {
    let variables = parameters.iter().map(|parameter| parameter.variable).chain(["task"]);
    match options.system {
        WorkerSystem::Linux => {
            let read: Vec<String> =
                variables.enumerate().map(|(at, name)| format!("{name}=${{{}-}}", at + 1)).collect();
            format!(
                "set -u\n{}\nframes=${{frames//:/x}}\nshot=(\"$show\"{}{})\n\
                 if [ \"$width\" -gt 0 ] && [ \"$height\" -gt 0 ]; then shot+=(--size \"${{width}}x$height\"); fi\n\
                 if [ \"$samples\" -gt 0 ]; then shot+=(--spp \"$samples\"); fi\n",
                read.join(" "),
                if job.settings.is_empty() { "" } else { " " },
                shell_words(&job.settings),
            )
        }
        WorkerSystem::Windows => {
            let read: Vec<String> = variables.map(|name| format!("${name}")).collect();
            let settings: String = job.settings.iter().map(|word| format!(", {}", power_shell(word))).collect();
            format!(
                "{} = $args\n$frames = $frames.Replace(':', 'x')\n$shot = @($show{settings})\n\
                 if ([int]$width -gt 0 -and [int]$height -gt 0) {{ $shot += '--size', \"${{width}}x${{height}}\" }}\n\
                 if ([int]$samples -gt 0) {{ $shot += '--spp', $samples }}\n",
                read.join(", ")
            )
        }
    }
}

/// The output is a folder, whatever it is called.
fn render_script(job: &FarmJob, options: &OpenJdOptions, parameters: &[JobParameter]) -> String {
    let shot = shot_lines(job, options, parameters);
    let is_chunked = options.chunk_seconds.is_some();
    match options.system {
        WorkerSystem::Linux => {
            let which = if is_chunked {
                "which=(--frames \"${task//:/x}\")"
            } else {
                "which=(--frames \"$frames\" --shard \"$task/$tasks\")"
            };
            format!(
                "{shot}# The frames of this task.\n{which}\n\
                 # A failure is told by the exit code: schedulers take openjd_fail alone for a remark.\n\
                 exec \"$anim\" render \"${{shot[@]}}\" \"${{which[@]}}\" -o \"$folder/\" --progress openjd\n"
            )
        }
        WorkerSystem::Windows => {
            let which = if is_chunked {
                "$which = '--frames', $task.Replace(':', 'x')"
            } else {
                "$which = '--frames', $frames, '--shard', \"$task/$tasks\""
            };
            format!(
                "{shot}# The frames of this task.\n{which}\n\
                 # A failure is told by the exit code: schedulers take openjd_fail alone for a remark.\n\
                 & $anim render @shot @which -o \"$folder/\" --progress openjd\nexit $LASTEXITCODE\n"
            )
        }
    }
}

fn check_script(job: &FarmJob, options: &OpenJdOptions, parameters: &[JobParameter]) -> String {
    let shot = shot_lines(job, options, parameters);
    match options.system {
        WorkerSystem::Linux => format!(
            "{shot}# Every frame by its hash; what is missing is a failure.\n\
             left=$(\"$anim\" plan \"${{shot[@]}}\" --frames \"$frames\" -o \"$folder/\" --left)\ncode=$?\n\
             if [ \"$code\" -eq 1 ]; then echo \"openjd_fail: missing frames: $left\"; fi\nexit \"$code\"\n"
        ),
        WorkerSystem::Windows => format!(
            "{shot}# Every frame by its hash; what is missing is a failure.\n\
             $left = & $anim plan @shot --frames $frames -o \"$folder/\" --left\n$code = $LASTEXITCODE\n\
             if ($code -eq 1) {{ Write-Output \"openjd_fail: missing frames: $left\" }}\nexit $code\n"
        ),
    }
}
