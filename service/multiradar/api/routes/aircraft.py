"""Routes of readsb, so that tar1090 and other programs show the tracks.

Clients add a number to the query against caches, so parameters are not checked.
"""

from fastapi import APIRouter
from starlette.responses import Response

from multiradar.access.requirement import DISPLAY
from multiradar.api.access import Granted
from multiradar.api.answers import encoding
from multiradar.api.answers.aircraft import AircraftJson, ReceiverJson

router = APIRouter(prefix="/data", tags=["tar1090"], dependencies=[DISPLAY])

# They change every second; a proxy must ask each time.
_HEADERS = {"cache-control": "no-cache"}


@router.get("/aircraft.json", response_model=AircraftJson)
async def aircraft(access: Granted) -> Response:
    """Return the confirmed tracks in readsb format, in feet, knots and degrees."""
    body = await access.workers.run(access.view.aircraft_json)
    return Response(body, media_type=encoding.JSON, headers=_HEADERS)


@router.get("/receiver.json", response_model=ReceiverJson)
async def receiver(access: Granted) -> Response:
    """Return the version, the refresh interval and the centre of the sensors."""
    found = await access.workers.run(access.view.receiver_json)
    return Response(encoding.document(found), media_type=encoding.JSON, headers=_HEADERS)
