//! What a driver checks of a command, output by output, and commands that a caller may have altered.

use policy::{DutyPath, Head};

use super::driver::Writer;
use super::stated::{Stated, label_of, stated, stated_of};
use super::text::Text;

impl Writer<'_> {
    /// A member of the command: of several outputs the place of one in its array.
    pub fn member(&self, name: &str, (index, path): (usize, &DutyPath<'_>)) -> String {
        match path.name {
            Some(_) => format!("command.{name}[{index}]"),
            None => format!("command.{name}"),
        }
    }

    /// What the command is after every step, and what that claims; of a chosen duty for finite numbers only where `finite_only` is.
    pub fn command(&mut self, finite_only: impl Fn(&Head) -> bool) -> Vec<Stated> {
        let mut claims = Vec::new();
        for output in self.policy.paths().iter().enumerate() {
            claims.extend(self.duties_of(output, finite_only(output.1.head)));
        }
        self.text.check("status", "command.status < 512u");
        claims.push(stated("status", "No bit of the status is set that has no meaning."));
        claims
    }

    /// Duty, chosen duty and action index of one output.
    fn duties_of(&mut self, output: (usize, &DutyPath<'_>), finite_only: bool) -> [Stated; 3] {
        let path = output.1;
        let limits = path.limits.duty;
        let (low, high) = (self.number.up(limits.low), self.number.down(limits.high));
        let fallback = self.literal(self.number.nearest(path.fallback));
        let (low, high) = (self.literal(low), self.literal(high));
        let duties = self.number.duties(path.head);
        let least = duties.iter().copied().fold(f64::INFINITY, f64::min);
        let most = duties.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (least, most) = (self.literal(least), self.literal(most));
        let actions = path.head.outputs();
        let [duty, chosen, action] = ["duty", "duty_sim", "action_index"].map(|member| self.member(member, output));
        self.text.check(
            &label_of("duty", output),
            &format!("({duty} >= {low} && {duty} <= {high}) || {duty} == {fallback}"),
        );
        let between = format!("({chosen} >= {least} && {chosen} <= {most}) || {chosen} == {fallback}");
        self.where_it_holds(finite_only, |text| text.check(&label_of("chosen", output), &between));
        self.text
            .check(&label_of("action", output), &format!("{action} < {actions}u"));
        [
            stated_of(
                "duty",
                output,
                "The duty{} is a number within its limits, or the fallback.",
            ),
            stated_of(
                "chosen",
                output,
                "The chosen duty{} lies between the least and the largest of all duties, or is the fallback.",
            )
            .finite_only(finite_only),
            stated_of("action", output, "The action index{} is below the number of actions."),
        ]
    }

    /// What a damaged state commands: every output its own fallback.
    pub fn fallbacks(&mut self) {
        for output in self.policy.paths().iter().enumerate() {
            let fallback = self.literal(self.number.nearest(output.1.fallback));
            let [duty, action] = ["duty", "action_index"].map(|member| self.member(member, output));
            self.text
                .check(&label_of("marked_duty", output), &format!("{duty} == {fallback}"));
            self.text
                .check(&label_of("marked_action", output), &format!("{action} == 0u"));
        }
    }

    /// A command, a variable of that name, that the caller may have changed in whatever way.
    pub fn any_command(&mut self, command: &str) {
        for output in self.policy.paths().iter().enumerate() {
            for (member, any) in [
                ("duty", "any_bits"),
                ("duty_sim", "any_bits"),
                ("action_index", "any_word"),
            ] {
                let place = self.member(member, output);
                let member = place.strip_prefix("command").unwrap_or(&place);
                self.text.line(format!("{command}{member} = {any};"));
            }
        }
        self.text.line(format!("{command}.status = any_word;"));
    }

    /// A check that may hold for finite numbers only.
    pub fn where_it_holds(&mut self, finite_only: bool, check: impl FnOnce(&mut Text)) {
        if finite_only {
            self.text.line("#if defined(FINITE)");
        }
        check(&mut self.text);
        if finite_only {
            self.text.line("#endif");
        }
    }

    /// The functions that compare coefficients with their check words, without the policy's prefix: that they belong together is
    /// what sound means.
    pub fn flips(&self) -> Vec<String> {
        let paths = self.policy.paths();
        let mapped = paths.iter().filter(|path| path.mapping.is_some());
        mapped.map(|path| path.named("mapping_flips")).collect()
    }
}
