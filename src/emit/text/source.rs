//! Comments of the WGSL sources, which naga's IR does not keep.

use crate::kernel::Linked;

/// The text that a kernel was made from.
#[derive(Debug)]
pub(super) struct Source<'a> {
    lines: Vec<&'a str>,
    /// Where each line begins.
    offsets: Vec<usize>,
}

fn comment_text(line: &str) -> Option<&str> {
    line.trim_start().strip_prefix("//").map(|text| text.strip_prefix(' ').unwrap_or(text))
}

impl<'a> Source<'a> {
    pub(super) fn new(linked: &'a Linked) -> Self {
        let lines: Vec<&str> = linked.text.lines().collect();
        let offsets = lines
            .iter()
            .scan(0, |offset, line| {
                let begin = *offset;
                *offset += line.len() + 1;
                Some(begin)
            })
            .collect();
        Self { lines, offsets }
    }

    /// Line that holds a byte of the text.
    pub(super) fn line_at(&self, offset: usize) -> usize {
        self.offsets.partition_point(|&begin| begin <= offset).saturating_sub(1)
    }

    /// The comment directly above a line.
    pub(super) fn comment_above(&self, line: usize) -> Vec<&'a str> {
        let above = self.lines[..line].iter().rev().map_while(|line| comment_text(line));
        let mut comment: Vec<_> = above.collect();
        comment.reverse();
        comment
    }

    /// Whether a line, or its comment, stands apart from what is above it.
    pub(super) fn has_blank_above(&self, line: usize) -> bool {
        let first = line - self.comment_above(line).len();
        first > 0 && self.lines[first - 1].trim().is_empty()
    }

    /// Line of the declaration that begins so.
    pub(super) fn declaration(&self, beginning: &str) -> Option<usize> {
        self.lines.iter().position(|line| {
            let name = |rest: &str| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_');
            line.split_once(beginning).is_some_and(|(before, rest)| {
                (before.is_empty() || before.ends_with(") ")) && !before.starts_with("//") && name(rest)
            })
        })
    }

    /// Line of a member of the struct declared at `line`.
    pub(super) fn member(&self, line: usize, name: &str) -> Option<usize> {
        let body = self.lines[line + 1..].iter().take_while(|line| !line.starts_with('}'));
        let is_member = |line: &&str| line.trim_start().strip_prefix(name).is_some_and(|rest| rest.starts_with(':'));
        body.into_iter().position(is_member).map(|index| line + 1 + index)
    }
}
