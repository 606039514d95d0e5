"""The operator's manual is followed as it is written, but for the installation."""

import re
from pathlib import Path

from support.paths import ROOT
from support.processes.in_shells import multiradar_in_shells
from support.processes.served import free_port
from support.processes.waiting import run_to_end

_MANUAL = (ROOT / "docs/howto/operations.md").read_text(encoding="utf-8")
_BLOCK = re.compile(r"```(sh|toml)\n(.*?)```", re.DOTALL)


def _script(programs: Path) -> tuple[str, str]:
    """Return the settings, and the commands with other programs and with ports that are free."""
    found = _BLOCK.findall(_MANUAL)
    (settings,) = (text for kind, text in found if kind == "toml")
    commands = "".join(text for kind, text in found if kind == "sh")
    install = f"{next(line for line in commands.splitlines() if 'install' in line)}\n"
    commands = commands.replace(install, "")
    assert "$CHECKOUT/.venv/bin" in commands
    commands = commands.replace("$CHECKOUT/.venv/bin", str(programs))
    for port in ("8331", "8332"):
        commands = commands.replace(port, f"{free_port()}")
    return settings, commands


def test_the_manual_leads_to_an_intact_state_after_drain_and_kill(tmp_path: Path) -> None:
    programs = tmp_path / "programs"
    programs.mkdir()
    settings, commands = _script(programs)
    (tmp_path / "service.toml").write_text(settings, encoding="utf-8")
    text = f"""
        export CHECKOUT={ROOT}
        trap 'kill $(jobs -p) 2>/dev/null || true' EXIT
        {commands}
        kill $ONE; wait $ONE || exit 9
        grep -c takeover: two.log one.log
        multiradar verify state
    """
    with multiradar_in_shells(programs):
        done = run_to_end(["bash", "-e", "-c", f"exec 2>&1\n{text}"], cwd=tmp_path)
    assert done.returncode == 0, done.stdout
    assert "23996 accepted, 0 rejected, 0 duplicate" in done.stdout
    assert "two.log:1\none.log:1\n" in done.stdout
    assert '"before": 50.0, "after": 60.0' in done.stdout
    intact = re.findall(r"^(\S+): intact: 24 entries, 23,996 measurements", done.stdout, re.M)
    assert intact == ["backups/first", "restored", "state"]
