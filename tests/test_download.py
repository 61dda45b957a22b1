"""Fetching from a server that misbehaves, which here is one on this computer."""

import json
import threading
from collections import Counter
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
import pytest

from data_tools import download as download_module
from data_tools.catalogue import Trial, choose, load_catalogue
from data_tools.download import BASE_URLS, main, trial_urls
from data_tools.fetching import ClipFolder, FetchError, Manners, OfflineError, fetch
from mocaplab.bvh import load_bvh, save_bvh
from mocaplab.datasets import load_dataset

WALKS = [trial.clip for trial in choose(load_catalogue(), {"walk": 3})]
QUICK = ["--wait", "0", "--pause", "0", "--timeout", "0.3"]


class Server:
    """Serves ``files`` by path; ``faults`` holds what goes wrong with a path, in order."""

    def __init__(self):
        self.files, self.faults, self.asked = {}, {}, Counter()
        self.stop = threading.Event()
        server = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self):
                server.answer(self)

            def log_message(self, *arguments):
                pass

        self.http = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.http.server_address[1]}"
        self.thread = threading.Thread(target=self.http.serve_forever, args=(0.02,), daemon=True)
        self.thread.start()

    def close(self):
        self.stop.set()
        self.http.shutdown()
        self.http.server_close()
        self.thread.join()

    def answer(self, request):
        path = request.path
        self.asked[path] += 1
        faults = self.faults.get(path, [])
        fault = faults.pop(0) if faults else None
        content = self.files.get(path)
        if fault == "slow":
            self.stop.wait(1)
            return
        if fault == "hang up":
            return
        status, headers = (fault, {}) if isinstance(fault, int) else (200, {})
        if isinstance(fault, tuple):
            status, headers = fault
        if content is None:
            status = 404
        request.send_response(status)
        for name, value in headers.items():
            request.send_header(name, value)
        if status != 200:
            content = b"sorry"
        request.send_header("Content-Length", str(len(content)))
        request.end_headers()
        request.wfile.write(content[: len(content) // 2] if fault == "cut" else content)


@pytest.fixture
def server(monkeypatch):
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    server = Server()
    yield server
    server.close()


@pytest.fixture
def walks(server, embedded, tmp_path):
    """Put three walks with a T-pose in front on the server, as the public mirror has them."""
    for i, clip in enumerate(WALKS):
        motion = embedded.clips[i].slice_frames(0, 130)
        rest = np.where(motion.skeleton.is_rotation, 0.0, motion.channels[0])
        save_bvh(motion.with_channels(np.vstack([rest, motion.channels])), tmp_path / "raw.bvh")
        server.files[path_of(clip)] = (tmp_path / "raw.bvh").read_bytes()
    return tmp_path / "cmu"


def path_of(clip):
    return f"/{int(clip.split('_')[0]):03d}/{clip}.bvh"


def run(server, folder, *more):
    arguments = ["--to", str(folder), "--base-url", server.url, "--actions", "walk"]
    return main(["cmu", *arguments, "--limit", "3", *QUICK, *more])


def test_the_addresses_of_both_sources():
    trial = Trial(2, 1, "walk", "walk", "named")
    assert trial_urls(trial, "bvh", BASE_URLS["bvh"]) == [
        "https://raw.githubusercontent.com/una-dinosauria/cmu-mocap/master/data/002/02_01.bvh"
    ]
    assert trial_urls(trial, "asfamc", "http://mocap.cs.cmu.edu/subjects/") == [
        "http://mocap.cs.cmu.edu/subjects/02/02.asf",
        "http://mocap.cs.cmu.edu/subjects/02/02_01.amc",
    ]


def test_a_folder_that_can_be_loaded_as_it_is(server, walks, embedded, capsys):
    assert run(server, walks) == 0
    printed = capsys.readouterr().out
    assert "3 of 3 clips" in printed
    assert f"{WALKS[0]}: took away the T-pose in front" in printed
    dataset = load_dataset("cmu", walks)
    assert sorted(WALKS) == [clip.name for clip in dataset.clips]
    assert dataset.actions == ("walk",) * 3
    np.testing.assert_allclose(
        load_bvh(walks / f"{WALKS[0]}.bvh").channels, embedded.clips[0].channels[:130]
    )
    record = json.loads((walks / "checksums.json").read_text())
    assert set(record["files"]) == {f"{clip}.bvh" for clip in WALKS}


def test_what_is_there_is_not_fetched_again(server, walks):
    assert run(server, walks) == 0
    assert run(server, walks) == 0
    assert set(server.asked.values()) == {1}
    (walks / f"{WALKS[0]}.bvh").write_text("damaged")  # made anew from what was fetched
    assert run(server, walks) == 0
    assert set(server.asked.values()) == {1}
    assert len(load_dataset("cmu", walks)) == 3


def test_a_missing_page_fails_alone(server, walks, capsys):
    del server.files[path_of(WALKS[1])]
    assert run(server, walks) == 1
    told = capsys.readouterr().err
    assert f"{path_of(WALKS[1])}: the server says 404 Not Found" in told
    assert "2 of 3 clips" in told
    assert "cannot be reached" not in told
    assert server.asked[path_of(WALKS[1])] == 1  # asking again would not help
    assert len(load_dataset("cmu", walks)) == 2


@pytest.mark.parametrize("fault", ["cut", "hang up", 503, 429, 500])
def test_a_passing_fault_is_survived(server, walks, fault):
    path = path_of(WALKS[0])
    server.faults[path] = [fault, fault]
    assert run(server, walks) == 0
    assert server.asked[path] == 3
    assert (walks / "raw" / f"{WALKS[0]}.bvh").read_bytes() == server.files[path]


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("cut", "the connection broke off"),
        (503, "the server says 503"),
        ("slow", "no answer in 0.3 s"),
    ],
)
def test_a_lasting_fault_leaves_no_part_behind(server, walks, capsys, fault, message):
    server.faults[path_of(WALKS[0])] = [fault] * 9
    assert run(server, walks) == 1
    assert message in capsys.readouterr().err
    assert server.asked[path_of(WALKS[0])] == 4
    for folder in (walks, walks / "raw"):
        assert {p.stem for p in folder.glob("*.bvh")} == set(WALKS[1:])
    assert len(list((walks / "raw").iterdir())) == 2  # nor any temporary file
    server.faults.clear()
    assert run(server, walks) == 0


def test_a_changed_file_is_refused(server, walks, capsys):
    assert run(server, walks) == 0
    name = f"{WALKS[0]}.bvh"
    (walks / name).unlink()
    (walks / "raw" / name).unlink()
    good = server.files[path_of(WALKS[0])]
    server.files[path_of(WALKS[0])] = good.replace(b"Hips", b"Hops")
    assert run(server, walks) == 1
    assert f"take {name} out of checksums.json" in capsys.readouterr().err
    assert not (walks / "raw" / name).exists()
    server.files[path_of(WALKS[0])] = good
    assert run(server, walks) == 0


def test_a_file_damaged_on_disk_is_fetched_anew(server, walks):
    assert run(server, walks) == 0
    for path in (walks / f"{WALKS[0]}.bvh", walks / "raw" / f"{WALKS[0]}.bvh"):
        path.write_bytes(path.read_bytes()[:-100])
    assert run(server, walks) == 0
    assert server.asked[path_of(WALKS[0])] == 2
    assert (walks / "raw" / f"{WALKS[0]}.bvh").read_bytes() == server.files[path_of(WALKS[0])]


def test_a_part_that_lies_there_is_not_taken_for_whole(server, walks):
    (walks / "raw").mkdir(parents=True)
    part = server.files[path_of(WALKS[0])][:5000]
    (walks / "raw" / f"{WALKS[0]}.bvh").write_bytes(part)
    assert run(server, walks) == 0
    assert (walks / "raw" / f"{WALKS[0]}.bvh").read_bytes() == server.files[path_of(WALKS[0])]


@pytest.mark.parametrize("garbage", [b"<html>Please log in</html>", b"", b"\0\1\2" * 50])
def test_garbage_is_refused_and_not_kept(server, walks, capsys, garbage):
    good, server.files[path_of(WALKS[0])] = server.files[path_of(WALKS[0])], garbage
    assert run(server, walks) == 1
    assert f"{WALKS[0]}: not a motion:" in capsys.readouterr().err
    assert not (walks / "raw" / f"{WALKS[0]}.bvh").exists()
    server.files[path_of(WALKS[0])] = good
    assert run(server, walks) == 0


def test_an_interrupted_run_goes_on(server, walks, monkeypatch, capsys):
    get_trial, calls = download_module.get_trial, []

    def stop_at_second(*arguments):
        calls.append(arguments)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return get_trial(*arguments)

    monkeypatch.setattr(download_module, "get_trial", stop_at_second)
    assert run(server, walks) == 130
    assert "goes on from here" in capsys.readouterr().err
    assert len(load_dataset("cmu", walks)) == 1
    assert run(server, walks) == 0
    assert set(server.asked.values()) == {1}


def test_offline_stops_at_once_and_says_what_to_do(server, tmp_path, capsys):
    server.close()
    assert run(server, tmp_path / "cmu") == 1
    told = capsys.readouterr().err
    assert "0 of 3 clips" in told
    assert told.count("not reached") == 1
    assert "2 further clips: not tried" in told
    assert "--source asfamc" in told
    assert 'load_dataset("embedded")' in told


def test_other_rates_are_kept_apart(server, walks, capsys):
    path = path_of(WALKS[0])
    text = server.files[path].decode()
    head, line, rest = text.partition("Frame Time: ")
    server.files[path] = (head + line + "0.02\n" + rest.partition("\n")[2]).encode()
    assert run(server, walks) == 0
    assert "50 fps is not a rate at which CMU recorded" in capsys.readouterr().out
    assert (walks / "other_rates" / f"{WALKS[0]}.bvh").exists()
    assert len(load_dataset("cmu", walks)) == 2


def test_one_folder_has_one_source(server, walks, capsys):
    assert run(server, walks) == 0
    assert run(server, walks, "--source", "asfamc") == 2
    assert "choose another folder with --to" in capsys.readouterr().err
    (walks / "checksums.json").write_text("{}")
    assert run(server, walks) == 2
    assert "expected JSON with source" in capsys.readouterr().err


def test_acclaim_files_come_in_pairs(server, data_dir, tmp_path):
    source = data_dir / "cmu_asfamc"
    for name in ("02.asf", "02_01.amc"):
        server.files[f"/02/{name}"] = (source / name).read_bytes()
    trial = Trial(2, 1, "walk", "walk", "named")
    folder = ClipFolder(tmp_path, "asfamc")
    manners = Manners(pause_s=0, wait_s=0)
    assert download_module.download([trial], "asfamc", server.url, folder, manners) == {}
    folder.write_list()
    assert load_dataset("cmu", tmp_path).clips[0].n_frames == 343


def test_waits_grow_and_the_server_may_ask_for_more(server, tmp_path):
    server.files["/a"] = b"a"
    server.faults["/a"] = [503, (503, {"Retry-After": "7"}), 503]
    slept = []
    fetch(f"{server.url}/a", tmp_path / "a", None, Manners(pause_s=0.5, sleep=slept.append))
    assert slept == [2, 7, 8, 0.5]
    for when in ("9999", "Fri, 31 Dec 2199 23:59:59 GMT"):
        server.faults["/b"] = [(429, {"Retry-After": when})]
        server.files["/b"] = b"b"
        with pytest.raises(FetchError, match=r"asks to come back in \d+ s"):
            fetch(f"{server.url}/b", tmp_path / "b", None, Manners(sleep=slept.append))
    server.faults["/b"] = [(503, {"Retry-After": "soon"})]
    fetch(f"{server.url}/b", tmp_path / "b", None, Manners(sleep=slept.append))


def test_no_server_is_told_from_a_bad_one(server, tmp_path):
    quick = Manners(tries=2, sleep=lambda seconds: None)
    with pytest.raises(FetchError, match="404"):
        fetch(f"{server.url}/none", tmp_path / "none", None, quick)
    server.close()
    with pytest.raises(OfflineError, match="not reached"):
        fetch(f"{server.url}/none", tmp_path / "none", None, quick)


@pytest.mark.parametrize(
    "arguments",
    [[], ["kit"], ["cmu", "--actions", "swim"], ["cmu", "--limit", "0"], ["cmu", "--pause", "-1"]],
)
def test_bad_arguments(arguments):
    with pytest.raises(SystemExit) as stop:
        main(arguments)
    assert stop.value.code == 2


def test_a_file_in_the_way(server, tmp_path):
    (tmp_path / "cmu").write_text("")
    assert run(server, tmp_path / "cmu") == 2


@pytest.mark.parametrize(
    "option", [["--timeout", "0"], ["--base-url", "nonsense"], ["--base-url", "ftp://x/y"]]
)
def test_options_without_sense_are_refused(option, tmp_path, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["cmu", "--to", str(tmp_path / "cmu"), *option])
    assert option[0] in capsys.readouterr().err
