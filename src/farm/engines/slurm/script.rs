//! The batch scripts: readable, complete, and good for submitting by hand.

use super::time::TimeLimit;
use crate::farm::engines::quoted;
use crate::farm::plan::Plan;

/// What a process takes beside what the plan counts \[bytes\].
const MARGIN: u64 = 256 << 20;
/// What a merge takes at most, whatever it merges \[bytes\]: moments and batch scores that do not fit wait in a file.
const MERGE: u64 = 512 << 20;
/// The merge waits so long for files that it does not see yet \[s\], and a third of its own time at most: NFS forgets what it
/// remembers after 60 s at most.
const LATE: u64 = 70;

/// A batch script and where it belongs.
#[derive(Clone, Debug)]
pub(super) struct Script {
    pub path: String,
    pub text: String,
}

/// One array task computes one shard: `program`, quoted, works on the folder at `root`, and compacts it wherever so many
/// shards have come together.
pub(super) fn shards(
    root: &str,
    program: &str,
    plan: &Plan,
    time: TimeLimit,
    together: Option<u64>,
    extra: &[String],
) -> Script {
    let path = format!("{root}/slurm/shards.sbatch");
    let head = head(root, plan, "%A_%a", plan.sizes().worker, time, extra);
    let compact = together.map_or_else(String::new, |together| format!(" --compact {together}"));
    let text = format!(
        "\
#!/bin/bash
# Written by `lampyris submit`. Each task of a job array computes the shard of its number; an argument is added to that number.
#   sbatch --array=0-{last} {script}
{head}#SBATCH --signal=B:USR2@{warning}

# The worker takes the place of this shell, so that Slurm's signals reach it: at SIGTERM it writes a checkpoint and waits to be
# killed; at SIGUSR2, before the time limit, it writes a checkpoint and requeues itself.
exec {program} work {folder} --shard \"$((${{1:-0}} + SLURM_ARRAY_TASK_ID))\" --threads \"${{SLURM_CPUS_PER_TASK:-1}}\"{compact}
",
        last = plan.shard_count() - 1,
        script = quoted(&path),
        warning = time.warning(),
        folder = quoted(root),
    );
    Script { path, text }
}

/// Merges what is there, and says what is missing.
pub(super) fn merge(root: &str, program: &str, plan: &Plan, time: TimeLimit, extra: &[String]) -> Script {
    let path = format!("{root}/slurm/merge.sbatch");
    let head = head(root, plan, "merge-%j", plan.sizes().worker.max(MERGE), time, extra);
    let text = format!(
        "\
#!/bin/bash
# Written by `lampyris submit`. Exit code 3: shards are missing, and the log says which and how to go on.
#   sbatch --dependency=afterany:<job of the shards> {script}
{head}
# What other nodes have written a network file system may show a minute late.
exec {program} merge {folder} --wait {late}
",
        late = LATE.min(time.0 / 3),
        script = quoted(&path),
        folder = quoted(root),
    );
    Script { path, text }
}

/// What both have in common. Of an option given twice Slurm takes the last.
fn head(root: &str, plan: &Plan, log: &str, memory: u64, time: TimeLimit, extra: &[String]) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' };
    let name: String = plan.name.chars().map(plain).collect();
    let megabytes = memory.saturating_add(memory / 2).saturating_add(MARGIN) >> 20;
    let mut text = format!(
        "\
#SBATCH --job-name={name}
#SBATCH --chdir=\"{root}\"
#SBATCH --output=slurm/{log}.log
#SBATCH --open-mode=append
#SBATCH --requeue
#SBATCH --nodes=1
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=1
#SBATCH --mem={megabytes}M
#SBATCH --time={time}
"
    );
    extra.iter().for_each(|line| text += &format!("#SBATCH {line}\n"));
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::farm::testing::plan;

    #[test]
    fn the_script_stands_on_its_own_and_quotes_what_a_shell_would_split() {
        let time: TimeLimit = "1:00:00".parse().unwrap();
        let extra = ["--partition=long".to_owned(), "--account=light -c 4".to_owned()];
        let script = shards("/data/it's here", "'/opt/my lampyris'", &plan(), time, None, &extra);
        assert_eq!(script.path, "/data/it's here/slurm/shards.sbatch");
        let lines: Vec<&str> = script.text.lines().collect();
        for line in [
            "#   sbatch --array=0-2 \"/data/it's here/slurm/shards.sbatch\"",
            "#SBATCH --job-name=test",
            "#SBATCH --chdir=\"/data/it's here\"",
            "#SBATCH --output=slurm/%A_%a.log",
            "#SBATCH --time=0-01:00:00",
            "#SBATCH --partition=long",
            "#SBATCH --account=light -c 4",
            "#SBATCH --signal=B:USR2@120",
            "exec '/opt/my lampyris' work \"/data/it's here\" --shard \"$((${1:-0} + SLURM_ARRAY_TASK_ID))\" \
             --threads \"${SLURM_CPUS_PER_TASK:-1}\"",
        ] {
            assert!(lines.contains(&line), "{line}\n{}", script.text);
        }
        let merge = merge("/data/a b", "lampyris", &plan(), time, &extra);
        let short = super::merge("/data", "lampyris", &plan(), TimeLimit(60), &[]);
        assert!(short.text.ends_with("--wait 20\n"));
        assert!(merge.text.ends_with("exec lampyris merge '/data/a b' --wait 70\n") && !merge.text.contains("signal"));
    }
}
