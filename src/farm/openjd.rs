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
    text += &parameters(job, options);
    text += "steps:\n";
    text += &render_step(job, options);
    text += &check_step(job, options);
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

fn parameters(job: &FarmJob, options: &OpenJdOptions) -> String {
    let mut text = String::from("parameterDefinitions:\n");
    let mut add = |name: &str, kind: &str, more: &str, default: Option<String>, about: &str| {
        let default = default.map_or(String::new(), |default| format!("  default: {default}\n"));
        let _ = writeln!(text, "- name: {name}\n  type: {kind}\n{more}{default}  description: {}", yaml(about));
    };
    let path = |path: &str| options.default_of(path).map(|path| yaml(&path));
    let file = "  objectType: FILE\n  dataFlow: IN\n";
    add("Input", "PATH", file, path(&job.input), "The script, scene or archive.");
    let folder = "  objectType: DIRECTORY\n  dataFlow: OUT\n";
    add("Output", "PATH", folder, path(&job.folder), "The folder of the frames.");
    let frames = Some(yaml(&job.frames.replace('x', ":")));
    add("Frames", "STRING", "", frames, "Ascending ranges, as in 1-10,20,30-60:5.");
    if options.chunk_seconds.is_none() {
        let count = Some(job.tasks.tasks.len().to_string());
        add("Tasks", "INT", "  minValue: 1\n", count, "Into how many parts of about the same cost.");
    }
    for (name, about) in [
        ("Width", "In pixels; 0: as the scene says."),
        ("Height", "In pixels; 0: as the scene says."),
        ("Samples", "Samples per pixel; 0: as the scene says."),
    ] {
        add(name, "INT", "  minValue: 0\n", Some("0".into()), about);
    }
    add("Anim", "STRING", "", Some(yaml(&job.anim)), "The program on the workers.");
    text
}

/// Values of parameters go to scripts as arguments, so that no quote or blank in them is read as code.
fn arguments(first: &[&str], values: &[&str]) -> String {
    let all = first.iter().chain(values).map(|value| yaml(value));
    format!("[{}]", all.collect::<Vec<_>>().join(", "))
}

fn action(options: &OpenJdOptions, values: &[&str]) -> String {
    let (command, first): (&str, &[&str]) = match options.system {
        WorkerSystem::Linux => ("bash", &["{{Task.File.Run}}"]),
        WorkerSystem::Windows => {
            ("powershell", &["-NoProfile", "-ExecutionPolicy", "Bypass", "-File", "{{Task.File.Run}}"])
        }
    };
    format!(
        "    actions:\n      onRun:\n        command: {command}\n        args: {}\n        cancelation:\n          \
         mode: NOTIFY_THEN_TERMINATE\n          notifyPeriodInSeconds: 60\n",
        arguments(first, values)
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

const COMMON_VALUES: [&str; 7] = [
    "{{Param.Anim}}",
    "{{Param.Input}}",
    "{{Param.Output}}",
    "{{Param.Frames}}",
    "{{Param.Width}}",
    "{{Param.Height}}",
    "{{Param.Samples}}",
];

fn render_step(job: &FarmJob, options: &OpenJdOptions) -> String {
    let mut text = String::from("- name: Render\n  hostRequirements:\n");
    let family = match options.system {
        WorkerSystem::Linux => "linux",
        WorkerSystem::Windows => "windows",
    };
    let cores = options.cores.unwrap_or(job.tasks.cores);
    let _ = write!(
        text,
        "    attributes:\n    - name: attr.worker.os.family\n      anyOf: [{family}]\n    amounts:\n    - name: \
         amount.worker.vcpu\n      min: {cores}\n    - name: amount.worker.memory\n      min: {}\n",
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
            ["{{Task.Param.Chunk}}", ""]
        }
        None => {
            text += "    - name: Task\n      type: INT\n      range: \"1-{{Param.Tasks}}\"\n";
            ["{{Task.Param.Task}}", "{{Param.Tasks}}"]
        }
    };
    text += "  script:\n";
    text += &embedded(options, &render_script(job, options));
    let values: Vec<&str> = COMMON_VALUES.iter().chain(&task).copied().collect();
    text.push_str(&action(options, &values));
    text
}

fn check_step(job: &FarmJob, options: &OpenJdOptions) -> String {
    let mut text = String::from("- name: Check\n  dependencies:\n  - dependsOn: Render\n  script:\n");
    text += &embedded(options, &check_script(job, options));
    text.push_str(&action(options, &COMMON_VALUES));
    text
}

/// What both scripts begin with: the shot with its settings.
fn shot_lines(job: &FarmJob, options: &OpenJdOptions) -> String {
    match options.system {
        WorkerSystem::Linux => format!(
            "set -u\nanim=$1 input=$2 output=$3 frames=${{4//:/x}} width=$5 height=$6 samples=$7\n\
             shot=(\"$input\"{}{})\n\
             if [ \"$width\" -gt 0 ] && [ \"$height\" -gt 0 ]; then shot+=(--size \"${{width}}x$height\"); fi\n\
             if [ \"$samples\" -gt 0 ]; then shot+=(--spp \"$samples\"); fi\n",
            if job.settings.is_empty() { "" } else { " " },
            shell_words(&job.settings),
        ),
        WorkerSystem::Windows => {
            let settings: String = job.settings.iter().map(|word| format!(", {}", power_shell(word))).collect();
            format!(
                "$anim, $program_input, $output, $frames, [int]$width, [int]$height, [int]$samples = $args[0..6]\n\
                 $frames = $frames.Replace(':', 'x')\n\
                 $shot = @($program_input{settings})\n\
                 if ($width -gt 0 -and $height -gt 0) {{ $shot += '--size', \"${{width}}x${{height}}\" }}\n\
                 if ($samples -gt 0) {{ $shot += '--spp', $samples }}\n"
            )
        }
    }
}

/// The output is a folder, whatever it is called.
fn render_script(job: &FarmJob, options: &OpenJdOptions) -> String {
    let shot = shot_lines(job, options);
    let is_chunked = options.chunk_seconds.is_some();
    match options.system {
        WorkerSystem::Linux => {
            let which = if is_chunked {
                "which=(--frames \"${8//:/x}\")"
            } else {
                "which=(--frames \"$frames\" --shard \"$8/$9\")"
            };
            format!(
                "{shot}# The frames of this task.\n{which}\n\
                 # A failure is told by the exit code: schedulers take openjd_fail alone for a remark.\n\
                 exec \"$anim\" render \"${{shot[@]}}\" \"${{which[@]}}\" -o \"$output/\" --progress openjd\n"
            )
        }
        WorkerSystem::Windows => {
            let which = if is_chunked {
                "$which = '--frames', $args[7].Replace(':', 'x')"
            } else {
                "$which = '--frames', $frames, '--shard', \"$($args[7])/$($args[8])\""
            };
            format!(
                "{shot}# The frames of this task.\n{which}\n\
                 # A failure is told by the exit code: schedulers take openjd_fail alone for a remark.\n\
                 & $anim render @shot @which -o \"$output/\" --progress openjd\nexit $LASTEXITCODE\n"
            )
        }
    }
}

fn check_script(job: &FarmJob, options: &OpenJdOptions) -> String {
    let shot = shot_lines(job, options);
    match options.system {
        WorkerSystem::Linux => format!(
            "{shot}# Every frame by its hash; what is missing is a failure.\n\
             left=$(\"$anim\" plan \"${{shot[@]}}\" --frames \"$frames\" -o \"$output/\" --left)\ncode=$?\n\
             if [ \"$code\" -eq 1 ]; then echo \"openjd_fail: missing frames: $left\"; fi\nexit \"$code\"\n"
        ),
        WorkerSystem::Windows => format!(
            "{shot}# Every frame by its hash; what is missing is a failure.\n\
             $left = & $anim plan @shot --frames $frames -o \"$output/\" --left\n$code = $LASTEXITCODE\n\
             if ($code -eq 1) {{ Write-Output \"openjd_fail: missing frames: $left\" }}\nexit $code\n"
        ),
    }
}
