"""Link back ends and link layers; they come by entry point and import `lcd_flight.model` and `lcd_flight.wire` only."""
