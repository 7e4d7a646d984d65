"""
Wear stages from recordings
===========================

Sixty recordings of the paper's wear test, simulated with noise: the resonance of each, the break in
its trend, and the probability of severe wear at each recording.
"""

import matplotlib.pyplot as plt

import asperity as asp
from asperity import paper, resonance
from asperity.trend import StageErrors

rig = paper.simulate_rig(
    paper.RigSettings(repeats=2, duration_s=5.0), disturbance=paper.Disturbance(snr_db=6.0)
)
clean = [
    resonance.remove_lines(recording.spectrum(20_000), shaft_hz=rig.shaft_hz)
    for recording in rig.recordings
]
resonances = resonance.series_resonances(
    [cleaned.spectrum for cleaned in clean],
    band_hz=rig.band_hz,
    kept=[cleaned.kept for cleaned in clean],
)

# %%
sq = [1e6 * recording.sq_m for recording in rig.recordings]
sq_std = [1e6 * recording.sq_std_m for recording in rig.recordings]
crf = [fitted.crf_hz for fitted in resonances]
stages = asp.split_stages(sq, crf, errors=StageErrors(x=sq_std), unit="um")

figure, axis = plt.subplots(figsize=(7, 4))
points = axis.scatter(
    sq, crf, c=100 * stages.probability, cmap="coolwarm", vmin=0, vmax=100, edgecolor="k"
)
axis.axvspan(*stages.interval, color="0.85", zorder=0, label="break, 90 % interval")
axis.axvline(stages.split, color="0.4", ls="--", label=f"break at {stages.split:.2f} µm")
figure.colorbar(points, label="probability of severe wear [%]")
axis.set(xlabel="Sq of the ring [µm]", ylabel="contact resonance [Hz]")
axis.legend(loc="lower right")
print(stages.verdict)
