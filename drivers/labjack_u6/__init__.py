"""The LabJack U6: six gauge voltages over USB."""
