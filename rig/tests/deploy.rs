//! The lines that hand a campaign to other machines, in `deploy/` and in the guide: the program takes their options, and their shards are
//! as many as are started.

use clap::Parser;
use std::path::Path;
use tractive_rig::campaign::options::CampaignOptions;
use tractive_rig::shards::Shard;

/// The program's word, and the options of `campaign`.
#[derive(Parser)]
struct Command {
    #[command(flatten)]
    options: CampaignOptions,
}

fn read(file: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(file)).unwrap()
}

/// The only line that holds all of the words.
fn line<'a>(text: &'a str, words: &[&str]) -> &'a str {
    let found: Vec<_> = text.lines().filter(|line| words.iter().all(|word| line.contains(word))).collect();
    let [line] = found[..] else { panic!("{words:?}: {found:?}") };
    line
}

/// The part of a line between two words; without a second one all that follows.
fn between<'a>(line: &'a str, from: &str, to: &str) -> &'a str {
    let (_, rest) = line.split_once(from).unwrap_or_else(|| panic!("{line} without {from}"));
    if to.is_empty() { rest } else { rest.split_once(to).unwrap_or_else(|| panic!("{line} without {to}")).0 }
}

/// The options behind the word `campaign`, quotes of a shell taken off.
fn options(line: &str) -> CampaignOptions {
    assert!(line.contains("tractive-rig campaign "), "{line}");
    let words = between(line, " campaign ", "").replace('"', "");
    let words = std::iter::once("campaign").chain(words.split_whitespace());
    Command::try_parse_from(words).unwrap_or_else(|error| panic!("{line}: {error}")).options
}

/// The shards' line, whose place for the number is filled in: every shard is one of all, each comes once, and the runs are at random.
fn is_whole(line: &str, place: &str, numbers: impl IntoIterator<Item = String>) -> CampaignOptions {
    let all: Vec<_> = numbers.into_iter().map(|number| options(&line.replace(place, &number))).collect();
    let wanted = (0..all.len()).map(|shard| Some(Shard { shard, shards: all.len() }));
    assert!(all.len() > 1 && all.iter().map(|options| options.shard).eq(wanted), "{line}");
    assert!(all[0].random.is_some_and(|runs| runs >= all.len()), "{line}");
    all[0].clone()
}

#[test]
fn gnu_parallel_starts_every_shard_once() {
    let guide = read("docs/campaigns.md");
    let (command, numbers) = line(&guide, &["parallel -j"]).split_once(" ::: ").unwrap();
    is_whole(command, "{}", numbers.split(' ').map(str::to_owned));
}

#[test]
fn kubernetes_completes_every_shard_and_keeps_them_in_its_claim() {
    let job = read("deploy/kubernetes.yaml");
    let completions: usize = between(line(&job, &["  completions: "]), ": ", "").parse().unwrap();
    let shard = line(&job, &["exec "]);
    let shards = is_whole(shard, "$JOB_COMPLETION_INDEX", (0..completions).map(|index| index.to_string()));
    let parallel: usize = between(line(&job, &["  parallelism: "]), ": ", "").parse().unwrap();
    assert!(parallel <= completions && job.contains("  completionMode: Indexed\n"));
    let claim = Path::new(between(line(&job, &["mountPath"]), ": ", ""));
    let merge = options(line(&job, &["--merge"]));
    assert!(shards.out.starts_with(claim) && merge.out.starts_with(claim), "{claim:?}");
    assert_eq!(merge.merge, [shards.out]);
}

#[test]
fn the_lines_for_slurm_are_of_a_campaign() {
    for file in ["docs/campaigns.md", "deploy/slurm.sh"] {
        let text = read(file);
        let array = line(&text, &["sbatch --array=0-"]);
        let last: usize = between(array, "--array=0-", " ").parse().unwrap();
        // As the job hands its own number to the program.
        let job = format!("{} --out /shared/out --shard ID/{}", array.trim_start_matches('#'), last + 1);
        is_whole(&job, "ID", (0..=last).map(|task| task.to_string()));
    }
}
