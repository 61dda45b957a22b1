"""The project's own files: versions in step, imports that point down, house rules."""

import ast
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from conftest import RUN_TIME

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).parent.parent
LIBRARY = sorted((ROOT / "mocaplab").glob("*.py"))
LIBRARY += sorted((ROOT / "mocaplab").glob("*/[!_]*.py"))
TOOLS = sorted((ROOT / "data_tools").glob("*.py"))
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))

# Each module may import only modules that stand on a line above its own.
LAYERS = [
    [
        "adaptive_filter",
        "commands.option_types",
        "estimate_bank",
        "files",
        "html_page",
        "layers",
        "learning.config",
        "learning.parallel",
        "live.lstm",
        "motion",
        "packing",
        "sliders",
        "splits",
        "worker_processes",
    ],
    [
        "blend",
        "bvh_hierarchy",
        "cleaner.pieces",
        "comparison.bootstrap",
        "cosine_windows",
        "euler",
        "exercises.answers",
        "findings",
        "gap_fillers.curves",
        "live.mixer",
        "live.statistics",
        "normalization",
        "quaternions",
        "skeletons.as_json",
        "skeletons.mirroring",
        "skeletons.rest_pose",
        "torch_kinematics",
    ],
    [
        "assignments.grading",
        "bvh",
        "cleaner.clip_view",
        "cleaner.fault_detection",
        "filters",
        "gap_fillers.filled",
        "gap_fillers.seams",
        "live.bank",
        "networks",
        "noise.angular",
        "rotations",
        "skeletons.units",
        "two_sources.losses",
        "two_sources.time_offset",
    ],
    [
        "checkpoints",
        "gap_fillers.kriging",
        "gap_fillers.pose_subspace",
        "kinematics",
        "live.angles",
        "live.filters",
        "motion_model",
        "noise.gaps",
        "poses",
        "resampling",
        "rotation_channels",
        "skeletons.matching",
        "tuning",
        "two_sources.baselines",
        "two_sources.networks",
        "two_sources.prediction_baselines",
        "two_sources.robust",
    ],
    [
        "cleaner.rate_matching",
        "doctor",
        "example_based",
        "gap_fillers.lowrank",
        "gap_fillers.pca",
        "inverse_kinematics",
        "kalman",
        "lab.gaussian",
        "learning.state",
        "measures.angles",
        "measures.movement",
        "noise.faults",
        "player_data",
        "plotting",
        "skeletons.retargeting",
        "smoothers",
        "stein",
        "streaming",
        "two_sources.model_files",
        "two_sources.noise",
        "two_sources.segments",
        "wiener",
    ],
    [
        "cleaner.network_runner",
        "foot_placement",
        "fusion",
        "gap_fillers.conditional_gaussian",
        "learning.batches",
        "learning.blend_lesson",
        "learning.live_plot",
        "measures.gaps",
        "measures.positions",
        "noise.spatial",
        "two_sources.batches",
        "two_sources.learning",
        "widgets",
    ],
    [
        "cleaner.piece_cleaner",
        "corruption",
        "gap_fillers.gaussian",
        "gap_fillers.network",
        "learning.lessons",
        "live.blend",
        "live.ebf",
        "measures.feet",
        "synthesis",
        "two_sources.training",
    ],
    [
        "datasets",
        "gap_fillers.files",
        "gap_fillers.gaussian_fit",
        "learning.recipe_lesson",
        "measures.by_name",
    ],
    ["cleaning"],
    [
        "cleaner.summary",
        "comparison.methods",
        "evaluation",
        "exercises.start",
        "lab.model",
        "noise.draws",
        "training",
    ],
    [
        "assignments.contest",
        "assignments.judges",
        "cleaner.pictures",
        "comparison.job",
        "comparison.network_methods",
        "exercises.beyond",
        "exercises.bvh",
        "exercises.comparing",
        "exercises.ebf",
        "exercises.gap_statistics",
        "exercises.gaps",
        "exercises.lab",
        "exercises.noise",
        "exercises.smoothing",
        "exercises.sources",
        "exercises.streaming",
        "exercises.training",
        "lab.data",
        "lab.picture",
    ],
    [
        "assignments.bvh",
        "assignments.filter",
        "assignments.gaps",
        "assignments.noise",
        "assignments.rotations",
        "assignments.smoothing",
        "cleaner.report",
        "comparison.result",
        "lab.widget",
    ],
    ["comparison.run_job"],
    ["cleaner.one_file", "comparison.job_runner", "comparison.report"],
    ["cleaner.folder", "comparison.gap_report"],
    ["commands.compare"],
    ["commands.evaluate"],
    ["reproduction.plan", "reproduction.verdicts"],
    ["reproduction.costs", "reproduction.needs"],
    ["reproduction.plots", "reproduction.scores", "reproduction.sources"],
    ["reproduction.networks_inside"],
    ["reproduction.claims"],
    ["reproduction.figure"],
    [
        "reproduction.figures_detail",
        "reproduction.figures_gaps",
        "reproduction.figures_noise",
        "reproduction.figures_over_time",
        "reproduction.figures_own",
        "reproduction.figures_sources",
        "reproduction.figures_streaming",
        "reproduction.figures_tables",
        "reproduction.report",
        "reproduction.stored",
    ],
    ["reproduction.figures"],
    ["reproduction.driver"],
    ["commands.reproduce", "exercises.reproduction"],
    ["commands.clean", "commands.corrupt", "commands.fuse", "commands.info", "commands.train"],
    ["cli"],
]
USES_TORCH = {
    "adaptive_filter",
    "assignments.filter",
    "assignments.gaps",
    "blend",
    "checkpoints",
    "cleaner.network_runner",
    "estimate_bank",
    "exercises.ebf",
    "exercises.training",
    "fusion",
    "gap_fillers.network",
    "layers",
    "learning.blend_lesson",
    "learning.lessons",
    "learning.parallel",
    "learning.recipe_lesson",
    "learning.state",
    "live.ebf",
    "live.lstm",
    "live.mixer",
    "networks",
    "reproduction.networks_inside",
    "reproduction.sources",
    "torch_kinematics",
    "training",
    "two_sources.learning",
    "two_sources.losses",
    "two_sources.model_files",
    "two_sources.networks",
    "two_sources.robust",
    "two_sources.training",
}


def pyproject():
    return tomllib.loads((ROOT / "pyproject.toml").read_text())


def ranges(requirements):
    """Turn 'numpy>=1.26,<3' into {'numpy': '>=1.26,<3'}."""
    pairs = (re.fullmatch(r"([\w.-]+)(.*)", text) for text in requirements)
    return {pair[1]: pair[2] for pair in pairs}


def module_name(path):
    """Name a module below mocaplab, such as motion or reproduction.plan."""
    return ".".join(path.relative_to(ROOT / "mocaplab").with_suffix("").parts)


def imports_of(path):
    """List the modules that a file imports, wherever in the file, types left out."""
    tree = ast.parse(path.read_text())
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING":
            node.body = []
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def test_environment_and_pyproject_agree():
    project = pyproject()["project"]
    wanted = ranges(project["dependencies"] + project["optional-dependencies"]["lab"])
    wanted["pytorch-cpu"] = wanted.pop("torch")
    wanted["python"] = project["requires-python"]
    listed = yaml.safe_load((ROOT / "environment.yml").read_text())["dependencies"]
    found = ranges(text for text in listed if isinstance(text, str) and text != "pip")
    by_pip = next(entry["pip"] for entry in listed if isinstance(entry, dict))
    found |= ranges(text for text in by_pip if text != "-e .")
    assert found == wanted


def test_pre_commit_runs_the_versions_of_pyproject():
    dev = pyproject()["project"]["optional-dependencies"]["dev"]
    pinned = dict(text.split("==") for text in dev if "==" in text)
    config = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())
    revisions = {repo["hooks"][0]["id"].split("-")[0]: repo["rev"] for repo in config["repos"]}
    assert revisions == {name: f"v{version}" for name, version in pinned.items()}


def test_version_is_said_once():
    from mocaplab import __version__

    assert pyproject()["project"]["version"] == __version__
    assert f"## {__version__}" in (ROOT / "CHANGELOG.md").read_text()
    assert f"version: {__version__}" in (ROOT / "CITATION.cff").read_text()


def test_every_module_has_a_layer():
    modules = {module_name(path) for path in LIBRARY} - {"__init__", "__main__"}
    assert modules == {name for layer in LAYERS for name in layer}


@pytest.mark.parametrize("path", LIBRARY, ids=module_name)
def test_imports_point_down(path):
    level = {name: i for i, layer in enumerate(LAYERS) for name in layer}
    module = module_name(path)
    if module not in level:  # __init__ and __main__
        return
    for name in imports_of(path):
        parts = name.split(".")
        assert parts[0] != "data_tools"
        if parts[0] == "mocaplab":
            for imported in (".".join(parts[1:2]), ".".join(parts[1:3])):
                if imported in level:
                    assert level[imported] < level[module], f"{module} imports {imported}"
        if parts[0] == "torch":
            assert module in USES_TORCH, f"{module} imports torch"


@pytest.mark.parametrize("path", LIBRARY + TOOLS, ids=lambda path: path.stem)
def test_no_global_seed(path):
    text = path.read_text()
    assert not re.search(r"np\.random\.(seed|rand|randn|normal|uniform|choice)\(", text)
    if path.stem != "layers":  # its helper seeded() forks the generator first
        assert "manual_seed" not in text


def test_importing_the_package_takes_no_torch_along():
    code = (
        "import sys, mocaplab, mocaplab.cli; mocaplab.load_bvh; "
        "heavy = {'torch', 'matplotlib', 'scipy', 'anywidget'} & set(sys.modules); "
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_public_names_exist():
    import mocaplab

    for name in mocaplab.__all__:
        assert getattr(mocaplab, name) is not None
        assert name in dir(mocaplab)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        mocaplab.nothing  # noqa: B018


def test_every_make_target_is_explained():
    help_text = subprocess.run(
        ["make", "help"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    for target in ("lab", "test", "format", "weights"):
        assert f"make {target} " in help_text


def test_continuous_integration_runs_the_command_of_the_readme():
    assert "make test" in (ROOT / ".ci" / "run").read_text()
    assert "make test" in (ROOT / "README.md").read_text()
    assert os.access(ROOT / ".ci" / "run", os.X_OK)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_opens_and_closes_as_all_do(path):
    cells = ["".join(cell["source"]) for cell in json.loads(path.read_text("utf-8"))["cells"]]
    assert "After this notebook you can" in cells[0]
    assert "**You need**" in cells[0]
    assert RUN_TIME.search(cells[0]), "no line with the minutes; see RUN_TIME in conftest.py"
    assert "## Recap" in cells[-1]
    assert "**Next:**" in cells[-1]


def test_readme_maps_every_notebook():
    readme = (ROOT / "README.md").read_text("utf-8")
    for path in NOTEBOOKS:
        first = "".join(json.loads(path.read_text("utf-8"))["cells"][0]["source"])
        rows = [line for line in readme.splitlines() if line.startswith("|")]
        row = next(line for line in rows if f"(notebooks/{path.name})" in line)
        found = RUN_TIME.search(first)
        assert found is not None
        assert f"| {found[3]} |" in row, "the README gives other minutes than the notebook"
