"""FMU: the ground shakes as recorded."""

from bristle.component import source
from bristle.fmu.component import SampleFile, SourceSlave
from bristle.physics.motion_file import HEADER

BUILT_IN = ("el_centro_1940_ns",)


class GroundMotion(SourceSlave):
    """Ground acceleration from a record, scaled to a peak and by a factor."""

    icon = "ground"
    file_of = SampleFile("record")
    header = HEADER
    files = ("data/ground_motions/el_centro_1940_ns.csv",)

    def declare(self):
        text = "record {record!r} is zero all along and has no peak to scale."
        self.texts = {source.NO_PEAK: text}
        record = self.baked.get("record", "el_centro_1940_ns")
        text = "a name baked in, or the path of a CSV `time [s],acceleration [m/s2]`"
        self.add_parameter("record", record, None, text)
        text = "scales the record to this peak; 0: as recorded"
        self.add_parameter("peak", 0.0, "m/s2", text, (0.0, 1e4))
        self.add_parameter(
            "factor", 1.0, "1", "multiplies the record, also after scaling", (-1e6, 1e6)
        )
        self.add_parameter("start", 0.0, "s", "time at which the record begins", (-1e9, 1e9))
        self.add_output(
            "ground_acceleration", "m/s2", "acceleration of the ground, positive along +x"
        )

    def bake(self):
        return source.bake_record(self.parameter_names())

    def bundled(self):
        return [*BUILT_IN, *filter(None, [self.baked.get("record")])]
