"""Track updates over Zenoh, from the posted measurement to a subscriber in another process."""

import socket
from statistics import median
from time import perf_counter

import zenoh

from benchmark.plan import Plan
from benchmark.report import Row
from benchmark.scenes.sky import make_recording
from benchmark.service.counting_subscriber import CountingSubscriber
from benchmark.service.server import Server
from multiradar.ingest.replay.http import MEDIA_TYPES, Encoding, encode
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.ingest.zenoh.session import zenoh_config

TEXT = (
    "Measurements enter over HTTP (Arrow, 1 000 per request), their track updates are "
    "published over Zenoh as JSON with cache and recovery. A subscriber in a third process "
    "counts distinct updates, from the first request to its last update. 1 000 aircraft. "
    "Peer: plain Zenoh, payloads of the same size and keys, put in a loop to the same "
    "subscriber, without tracker, cache or JSON."
)
AIRCRAFT = 1_000
ROWS = 40_000
BATCH = 1_000
PATIENCE_S = 8.0
#: About the size of an update as JSON.
PAYLOAD = bytes(400)


def run(plan: Plan) -> list[Row]:
    """Measure updates received per second, and the number lost."""
    count = plan.size(ROWS)
    plain = median(_plain(count) for _ in range(plan.runs))
    endpoint = _free_endpoint()
    recording = make_recording((plan.runs + 1) * count, plan.size(AIRCRAFT))
    rates, lost = [], 0
    with Server(plan.folder / "server", endpoint) as server, CountingSubscriber(endpoint) as heard:
        for part in recording.iter_slices(count):
            bodies = [encode(piece, Encoding.ARROW) for piece in part.iter_slices(BATCH)]
            before, _ = heard.count()
            begin = perf_counter()
            server.post(bodies, MEDIA_TYPES[Encoding.ARROW], in_flight=1)
            server.wait_processed()
            sent = int(server.status()["output_sequence"])
            received, last_s = heard.wait_for(sent, PATIENCE_S)
            rates.append((received - before) / (last_s - begin))
            lost = sent - received
    # The first run creates the keys and caches of all tracks.
    label = f"{plan.size(AIRCRAFT)} tracks"
    return [
        Row(f"{label}: received", median(rates[1:]), "updates/s", plan.runs, "plain put", plain),
        Row(f"{label}, just initiated: received", rates[0], "updates/s", 1, "plain put", plain),
        Row(f"{label}: lost", lost, "updates", plan.runs + 1),
    ]


def _plain(count: int) -> float:
    endpoint = _free_endpoint()
    session = zenoh.open(zenoh_config(ZenohOptions(listen=(endpoint,))))
    with CountingSubscriber(endpoint) as heard:
        begin = perf_counter()
        for number in range(count):
            session.put(
                f"multiradar/v1/tracks/{number % AIRCRAFT + 1}",
                PAYLOAD,
                attachment=b"%d" % number,
                congestion_control=zenoh.CongestionControl.BLOCK,
            )
        received, last_s = heard.wait_for(count, PATIENCE_S)
    session.close()  # type: ignore[no-untyped-call]  # so in its stubs
    return received / (last_s - begin)


def _free_endpoint() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"
