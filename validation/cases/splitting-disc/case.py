"""Stiffness, strength, and damage of a disc between plates."""
import numpy as np


def measures(task, result):
    strain, stress = result.series["strain"].values, result.series["stress"].values
    peak = int(np.argmax(np.abs(stress)))
    # straight line through the points below 30 % of the strength
    low = np.arange(len(stress)) < peak
    low &= np.abs(stress) <= 0.3 * abs(stress[peak])
    out = {"strength": float(stress[peak]), "stiffness": float(np.polyfit(strain[low], stress[low], 1)[0])}
    if "damage_field" in result.series:
        out["mean_damage"] = float(result.series["damage_field"].values[-1].mean())
    return out
