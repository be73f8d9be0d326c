"""A run's trace as Parquet and MCAP."""

from __future__ import annotations

import json
from pathlib import Path

from .runs import Run


def parquet(run: Run, path) -> None:
    """Writes the trace, with what was run in the table's metadata. Needs pyarrow."""
    import pyarrow
    import pyarrow.parquet

    table = pyarrow.Table.from_pandas(run.trace.reset_index(), preserve_index=False)
    about = {"tractive": json.dumps({key: value for key, value in run.summary.items() if key != "figures"})}
    pyarrow.parquet.write_table(table.replace_schema_metadata({**(table.schema.metadata or {}), **about}), path)


def mcap(run: Run, path) -> None:
    """Writes the trace as JSON messages on the topic /trace, and the edges on /edges. Needs mcap."""
    from mcap.writer import Writer

    with Path(path).open("wb") as file:
        writer = Writer(file)
        writer.start(profile="", library="tractive")
        tables = [("/trace", run.trace), ("/edges", run.edges)]
        events = []
        for topic, table in tables:
            fields = {"t_s": {"type": "number"}} | {
                name: {"type": "string" if str(kind) == "category" else "number"} for name, kind in table.dtypes.items()
            }
            schema = json.dumps({"type": "object", "properties": fields}).encode()
            schema_id = writer.register_schema(name=topic[1:], encoding="jsonschema", data=schema)
            channel_id = writer.register_channel(topic=topic, message_encoding="json", schema_id=schema_id)
            records = table.reset_index().to_dict("records")
            events += [(record["t_s"], channel_id, record) for record in records]
        events.sort(key=lambda event: event[0])
        for t_s, channel_id, record in events:
            at = round(t_s * 1e9)
            writer.add_message(channel_id=channel_id, log_time=at, publish_time=at, data=json.dumps(record).encode())
        writer.finish()
