"""Moduli and strength of a cell under lateral stress."""
import numpy as np

# Steps of the first stage.
CONSOLIDATED = 3000


def measures(task, result):
    """Axial modulus and Poisson's ratio while nothing is damaged, and the largest stress difference."""
    axial, whole = result.series["strain"], result.series["whole.stress"]
    volume = result.series["whole.volume"].values
    late = whole.steps >= CONSOLIDATED
    strain = axial.values[late]
    stress = whole.values[late][:, [0, 1, 2], [0, 1, 2]]
    lateral = 0.5 * (stress[:, 0] + stress[:, 1])
    # Volume strain is the product of the stretches.
    across = np.sqrt(volume[late] / volume[0] / (1 + strain)) - 1
    along = strain - strain[0]
    window = (along < -2e-4) & (along > -6e-4)
    difference = stress[:, 2] - lateral
    peak = int(np.argmin(difference))
    return {
        "young": float(np.polyfit(along[window], difference[window], 1)[0]),
        "poisson": -float(np.polyfit(along[window], across[window], 1)[0]),
        "consolidated": [float(axial.values[~late][-1]), float(volume[~late][-1] / volume[0] - 1)],
        "strength": float(difference[peak]), "strain_at_peak": float(along[peak]),
        # until the peak; then the cell widens suddenly
        "lateral": float(np.abs(lateral[:peak] / -5e6 - 1).max()),
    }
