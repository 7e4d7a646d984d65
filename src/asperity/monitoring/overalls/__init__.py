"""Series of overall values, as a plant historian stores them: reading and judgement."""
