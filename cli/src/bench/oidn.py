# Denoises frames from standard input with Intel Open Image Denoise, each alone, in one process.
# A frame is width and height (two u32), then float32 RGB images, row by row: radiance, normal, albedo.
# The answer is wall and process CPU seconds (two f64) and the float32 RGB result. Little-endian throughout.
import os
import resource
import signal
import struct
import sys
import time

# Whatever the library prints must not end up between the frames.
answer = os.fdopen(os.dup(1), "wb")
os.dup2(2, 1)

# Ctrl-C is for the parent, which ends this process when it is done.
signal.signal(signal.SIGINT, signal.SIG_IGN)

GUIDES = ("color", "normal", "albedo")
try:
    import numpy
    import pyoidn

    device = pyoidn.Device()
    device.commit()
    greeting = "ready"
except Exception as error:
    greeting = f"{type(error).__name__}: {error}".splitlines()[0]
answer.write(f"{greeting}\n".encode())
answer.flush()
if greeting != "ready":
    sys.exit(1)


def cpu_seconds():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


size, images, network = None, {}, None
while len(header := sys.stdin.buffer.read(8)) == 8:
    width, height = struct.unpack("<2I", header)
    if (width, height) != size:
        # The network is set up once for each size, as a renderer would.
        size = (width, height)
        images = {name: numpy.zeros((height, width, 3), numpy.float32) for name in (*GUIDES, "output")}
        network = pyoidn.Filter(device, pyoidn.OIDN_FILTER_TYPE_RT)
        for name, image in images.items():
            network.set_image(name, image, pyoidn.OIDN_FORMAT_FLOAT3)
        network.set_bool("hdr", True)
        network.commit()
    for name in GUIDES:
        data = sys.stdin.buffer.read(12 * width * height)
        images[name][:] = numpy.frombuffer(data, "<f4").reshape(height, width, 3)
    cpu, wall = cpu_seconds(), time.perf_counter()
    network.execute()
    answer.write(struct.pack("<2d", time.perf_counter() - wall, cpu_seconds() - cpu))
    answer.write(images["output"].astype("<f4").tobytes())
    answer.flush()
