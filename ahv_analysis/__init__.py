"""What happens around a flight: engines, bags, figures, the `ahv` command."""
